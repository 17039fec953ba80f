#include "api/picture.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "api/length_unit.h"
#include "api/render_id.h"
#include "core/error.h"

namespace fstop::api {
namespace {

std::vector<std::string> channel_names(Output output) {
  switch (output) {
    case Output::color:
      return {"R", "G", "B"};
    case Output::depth:
      return {"Z"};
    case Output::coc:
      return {"coc.signed"};
    case Output::all_in_focus:
      return {"aif.R", "aif.G", "aif.B"};
    case Output::variance:
      return {"var.R", "var.G", "var.B"};
    case Output::normal:
      return {"N.X", "N.Y", "N.Z"};
    case Output::distance:
      return {"dist.ray"};
    case Output::coc_diameter:
      return {"coc.diameter"};
    case Output::valid:
      return {"mask.valid"};
    case Output::alpha:
      return {"A"};
  }
  throw Error(ErrorCode::internal, "an output without channels");
}

std::string coordinates_text(Vec3 v) {
  std::string text;
  for (const double value : {v.x, v.y, v.z}) {
    std::array<char, 40> digits = {};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    text += (text.empty() ? "" : " ") + std::string(digits.data(), end.ptr);
  }
  return text;
}

class Attributes {
 public:
  void add(std::string name, std::variant<double, int, std::string> value) {
    list_.push_back({std::move(name), std::move(value)});
  }
  // In the unit that the name says, or in the one that OpenEXR's standard attributes prescribe
  // (openexr.com, StandardAttributes: focus m, focal lengths mm, photosite pitch microns).
  void add_length(std::string name, std::string_view unit, Length length) {
    add(std::move(name), unit_of_suffix(unit).number(length));
  }
  std::vector<ImageAttribute> list() && { return std::move(list_); }

 private:
  std::vector<ImageAttribute> list_;
};

void add_optics(Attributes& attributes, const CameraSpec& camera) {
  if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) {
    attributes.add("aperture", lens->lens.f_number);
    attributes.add_length("focus", "_m", lens->focus_distance);
    attributes.add_length("nominalFocalLength", "_mm", lens->lens.focal_length);
    attributes.add("fstop:blades", lens->aperture.blades);
    attributes.add("fstop:breathing", camera.breathing ? 1 : 0);
  } else {
    attributes.add("aperture", working_f_number(camera));
    attributes.add_length("fstop:pinholeDiameterMm", "_mm", pupil_diameter(camera));
  }
  // The distance from the centre of projection to the sensor, of lens and pinhole alike.
  attributes.add_length("pinholeFocalLength", "_mm", sensor_distance(camera));
  attributes.add("fstop:workingFNumber", working_f_number(camera));
}

std::vector<ImageAttribute> attributes_of(const SimulationSpec& spec, std::string_view id) {
  const CameraSpec& camera = spec.camera;
  Attributes attributes;
  attributes.add("fstop:engine", std::string(engine_version()));
  attributes.add("fstop:requestHash", std::string(id));
  attributes.add("fstop:seed", std::to_string(spec.seed));  // 32 bits unsigned: no int of EXR
  add_optics(attributes, camera);
  attributes.add("expTime", camera.shutter_seconds);
  if (camera.exposure) attributes.add("isoSpeed", camera.exposure->iso);
  attributes.add_length("sensorPhotositePitch", "_um", camera.sensor_width / spec.width);
  attributes.add_length("fstop:sensorWidthMm", "_mm", camera.sensor_width);
  attributes.add_length("fstop:sensorHeightMm", "_mm", camera.sensor_height);
  attributes.add_length("fstop:wavelengthNm", "_nm", camera.wavelength);
  attributes.add("fstop:cameraPosition", coordinates_text(camera.position));
  attributes.add("fstop:cameraLookAt", coordinates_text(camera.look_at));
  attributes.add("fstop:cameraUp", coordinates_text(camera.up));
  return std::move(attributes).list();
}

const Image& image_of(const Photograph& photograph, Output output) {
  if (output == Output::color) return photograph.color;
  const auto found = photograph.layers.find(output);
  if (found == photograph.layers.end()) {
    throw Error(ErrorCode::not_found,
                "this render has no output " + std::string(output_name(output)));
  }
  return found->second;
}

// Colours and alpha in one layer of four channels, the colours no longer multiplied by it.
ImageLayer straight_layer(const Image& color, const Image& alpha) {
  Image straight(color.width(), color.height(), 4);
  for (int y = 0; y < color.height(); ++y) {
    for (int x = 0; x < color.width(); ++x) {
      const float share = *alpha.at(x, y);
      float* to = straight.at(x, y);
      for (int c = 0; c < 3; ++c) to[c] = share > 0.0F ? color.at(x, y)[c] / share : 0.0F;
      to[3] = share;
    }
  }
  return {{"R", "G", "B", "A"}, std::move(straight)};
}

}  // namespace

std::vector<Output> layers_needed(ImageFormat format, const std::vector<Output>& asked) {
  std::vector<Output> needed = asked;
  needed.push_back(Output::color);
  if (format == ImageFormat::exr) needed.insert(needed.end(), {Output::depth, Output::coc});
  std::ranges::sort(needed);
  const auto repeated = std::ranges::unique(needed);
  needed.erase(repeated.begin(), repeated.end());
  return needed;
}

Picture picture_of(const Photograph& photograph, const SimulationSpec& spec, std::string_view id,
                   ImageFormat format) {
  Picture picture;
  const bool is_data = format == ImageFormat::exr || format == ImageFormat::tiff;
  if (spec.halftone && !is_data) {
    picture.layers.push_back(
        {channel_names(Output::color), halftone(photograph.color, *spec.halftone)});
    return picture;
  }
  const auto alpha = photograph.layers.find(Output::alpha);
  picture = color_picture(photograph.color,
                          alpha == photograph.layers.end() ? Image() : alpha->second, format);
  for (const auto& [output, image] : photograph.layers) {
    if (output != Output::color && output != Output::alpha)
      picture.layers.push_back({channel_names(output), image});
  }
  picture.attributes = attributes_of(spec, id);
  return picture;
}

Picture color_picture(const Image& color, const Image& alpha, ImageFormat format) {
  if (alpha.empty()) return {.layers = {{channel_names(Output::color), color}}};
  if (format == ImageFormat::jpeg) throw Error(ErrorCode::unsupported, "jpeg holds no alpha");
  if (format != ImageFormat::exr) return {.layers = {straight_layer(color, alpha)}};
  return {.layers = {{channel_names(Output::color), color}, {channel_names(Output::alpha), alpha}}};
}

Picture output_picture(const Photograph& photograph, Output output, const SimulationSpec& spec,
                       std::string_view id) {
  return {.layers = {{channel_names(output), image_of(photograph, output)}},
          .attributes = attributes_of(spec, id)};
}

}  // namespace fstop::api
