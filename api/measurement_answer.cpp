#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/length_unit.h"
#include "api/measurement_request.h"
#include "api/problem.h"
#include "core/measure/disc_edge.h"
#include "core/scene/scene_file.h"

namespace fstop::api {
namespace {

constexpr std::size_t kChannels = 3;

// Lengths in a picture: in pixels, and on the sensor where its pixels' pitch is known.
struct Scale {
  std::optional<Length> pitch = {};

  void put(Json& item, const std::string& name, double pixels) const {
    item[name + "_px"] = number_json(pixels);
    if (pitch) put_length(item, name + "_um", pixels * *pitch);
  }
  void put_frequency(Json& item, const std::string& name, double per_px) const {
    item[name + "_per_px"] = number_json(per_px);
    if (!pitch) return;
    const double per_metre = per_px / pitch->si();
    item[name + "_per_mm"] = number_json(per_metre / unit_of_suffix("_mm").per_metre);
  }
};

// The measured channel of a region, as an image of its own.
Image channel_of(ImageView<const float> image, MeasuredChannel channel, const PixelRegion& region) {
  // Rec. 709, of linear values.
  constexpr std::array<std::array<double, kChannels>, 4> kWeights = {
      {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {0.2126, 0.7152, 0.0722}}};
  const auto& weights = kWeights[static_cast<std::size_t>(channel)];
  Image result(region.width, region.height, 1);
  for (int y = 0; y < region.height; ++y) {
    for (int x = 0; x < region.width; ++x) {
      const float* rgb = image.at(region.x + x, region.y + y);
      double value = 0.0;
      for (std::size_t c = 0; c < kChannels; ++c) {
        if (weights[c] != 0.0) value += weights[c] * rgb[c];
      }
      *result.at(x, y) = static_cast<float>(value);
    }
  }
  return result;
}

Json point_json(Vec2 point) { return {{"x", number_json(point.x)}, {"y", number_json(point.y)}}; }

Json region_json(const PixelRegion& region) {
  return {{"x", region.x}, {"y", region.y}, {"width", region.width}, {"height", region.height}};
}

void put_levels(Json& item, const EdgeLevels& levels) {
  item["levels"] = {{"dark", number_json(levels.dark)}, {"bright", number_json(levels.bright)}};
}

/// Answers one question; all coordinates inside are of the region's own image.
class Answerer {
 public:
  Answerer(ImageView<const float> image, Scale scale, const MeasurementQuestion& question)
      : image_(image), scale_(scale), question_(question) {}

  Json answer() const {
    return std::visit([this](const auto& kind) { return of(kind); }, question_.kind);
  }

  /// Pixels that are looked at.
  double pixels() const {
    if (const auto* star = std::get_if<StarQuestion>(&question_.kind)) {
      double sum = 0.0;
      for (const double radius : star->radii) sum += 4.0 * radius * radius;
      return sum;
    }
    const PixelRegion region = this->region();
    return static_cast<double>(region.width) * region.height;
  }

 private:
  PixelRegion region() const {
    return question_.region.value_or(
        PixelRegion{.x = 0, .y = 0, .width = image_.width, .height = image_.height});
  }

  Image measured_part() const {
    const PixelRegion part = region();
    const bool inside = part.width >= 3 && part.height >= 3 &&
                        part.width <= image_.width - part.x &&
                        part.height <= image_.height - part.y;
    if (!inside) {
      throw Error(ErrorCode::outside_domain,
                  "the region must lie inside the picture, " + std::to_string(image_.width) +
                      " x " + std::to_string(image_.height) + " px, and be at least 3 px a side");
    }
    return channel_of(image_, question_.channel, part);
  }

  static PixelRegion all_of(const Image& part) {
    return {.x = 0, .y = 0, .width = part.width(), .height = part.height()};
  }

  Vec2 in_picture(Vec2 point) const {
    const PixelRegion part = region();
    return {point.x + part.x, point.y + part.y};
  }

  Json head(const char* kind) const { return {{"kind", kind}, {"region", region_json(region())}}; }

  Json of(const SharpnessQuestion&) const {
    const Image part = measured_part();
    const auto score = [&](SharpnessScore which) {
      return number_json(sharpness(which, part.view(), 0, all_of(part)));
    };
    Json item = head("sharpness");
    item["variance_of_laplacian"] = score(SharpnessScore::variance_of_laplacian);
    item["tenengrad"] = score(SharpnessScore::tenengrad);
    item["brenner"] = score(SharpnessScore::brenner);
    return item;
  }

  Json of(const EdgeQuestion& question) const {
    const Image part = measured_part();
    const SlantedEdge edge = measured_slanted_edge(
        part.view(), {.region = all_of(part), .channel = 0, .levels = question.levels});
    Json item = head("slanted-edge");
    item["point_px"] = point_json(in_picture(edge.point));
    item["normal"] = point_json(edge.normal);
    item["slant_deg"] = number_json(edge.slant * 180.0 / std::numbers::pi);
    put_levels(item, edge.levels);
    item["noise"] = number_json(edge.noise);
    scale_.put(item, "reach", edge.reach);
    scale_.put(item, "rise_10_90", edge.rise_10_90);
    scale_.put_frequency(item, "mtf50", edge.mtf50);
    Json& mtf = item["mtf"] = Json::array();
    for (std::size_t k = 0; k < edge.mtf.size(); ++k) {
      Json& at = mtf.emplace_back(Json::object());
      scale_.put_frequency(at, "frequency", static_cast<double>(k) / 100.0);
      at["mtf"] = number_json(edge.mtf[k]);
    }
    return item;
  }

  Json of(const DiscEdgeQuestion&) const {
    const Image part = measured_part();
    const DiscEdge edge = fit_disc_radius(part.view(), {.region = all_of(part), .channel = 0});
    Json item = head("disc-edge");
    scale_.put(item, "diameter", 2.0 * edge.radius);
    item["point_px"] = point_json(in_picture(edge.point));
    item["normal"] = point_json(edge.normal);
    put_levels(item, edge.levels);
    item["residual"] = number_json(edge.residual);
    return item;
  }

  Json of(const SpotQuestion& question) const {
    const Image part = measured_part();
    SpotSpec spec = question.spec;
    spec.region = all_of(part);
    const Spot spot = measured_spot(part.view(), spec);
    Json item = head("spot");
    scale_.put(item, "disc_diameter", spot.disc_diameter);
    item["mean_square_px2"] = number_json(spot.mean_square);
    item["centroid_px"] = point_json(in_picture(spot.centroid));
    item["energy"] = number_json(spot.energy);
    item["background"] = number_json(spot.background);
    Json& circles = item["encircled_energy"] = Json::array();
    for (std::size_t i = 0; i < spec.fractions.size(); ++i) {
      Json& circle = circles.emplace_back(Json{{"fraction", number_json(spec.fractions[i])}});
      scale_.put(circle, "diameter", spot.encircled_diameters[i]);
    }
    return item;
  }

  Json of(const StarQuestion& question) const {
    const PixelRegion all = {.x = 0, .y = 0, .width = image_.width, .height = image_.height};
    const Image picture = channel_of(image_, question_.channel, all);
    Json item = {{"kind", "star"}};
    Json& rings = item["rings"] = Json::array();
    for (const double radius : question.radii) {
      const StarContrast ring = star_contrast(picture.view(), 0, question.star, radius);
      Json& one = rings.emplace_back(Json::object());
      scale_.put(one, "radius", radius);
      scale_.put_frequency(one, "frequency", ring.frequency);
      one["modulation"] = number_json(ring.modulation);
      one["quadrature"] = number_json(ring.quadrature);
      one["mean"] = number_json(ring.mean);
    }
    return item;
  }

  ImageView<const float> image_;
  Scale scale_;
  const MeasurementQuestion& question_;
};

std::string pointer_of(std::size_t question) {
  return "#/measurements/" + std::to_string(question);
}

}  // namespace

std::string measurement_json(const MeasurementRequest& request, ImageView<const float> image,
                             std::optional<Length> pixel_pitch, const Limits& limits) {
  const Scale scale{.pitch = pixel_pitch};
  Json value = {{"width", image.width}, {"height", image.height}};
  if (pixel_pitch) put_length(value, "pixel_um", *pixel_pitch);
  Json& answers = value["measurements"] = Json::array();
  std::vector<FieldFault> faults;
  double pixels = 0.0;
  for (std::size_t i = 0; i < request.questions.size(); ++i) {
    const Answerer answerer(image, scale, request.questions[i]);
    pixels += answerer.pixels();
    if (pixels > limits.measured_pixels) {
      throw InvalidRequest(
          FieldFault{pointer_of(i), "with those before it looks at more than " +
                                        number_text(limits.measured_pixels) + " pixels"},
          ErrorCode::over_budget);
    }
    try {
      answers.push_back(answerer.answer());
    } catch (const Error& error) {
      if (error.code() != ErrorCode::outside_domain) throw;
      faults.push_back({pointer_of(i), error.what()});
    }
  }
  if (!faults.empty()) throw InvalidRequest(std::move(faults), ErrorCode::outside_domain);
  return json_text(value);
}

Image read_sent_image(std::string_view bytes, ColorSpace color_space, const Limits& limits) {
  AssetLimits assets = limits.assets;
  assets.max_texture_pixels = limits.measured_image_pixels;
  return decode_texture("the image", std::as_bytes(std::span(bytes)), color_space, assets);
}

Image read_sent_layer(std::string_view bytes, ColorSpace color_space, const Limits& limits) {
  AssetLimits assets = limits.assets;
  assets.max_texture_pixels = limits.measured_image_pixels;
  const auto file = std::as_bytes(std::span(bytes));
  const Image color = decode_texture("the image", file, color_space, assets);
  const Image alpha = decode_alpha("the image", file, assets);
  if (alpha.empty()) return color;
  Image layer(color.width(), color.height(), 4);
  for (int y = 0; y < color.height(); ++y) {
    for (int x = 0; x < color.width(); ++x) {
      std::copy_n(color.at(x, y), kChannels, layer.at(x, y));
      layer.at(x, y)[kChannels] = *alpha.at(x, y);
    }
  }
  return layer;
}

std::string packed_image(const Image& image) {
  std::string text = std::to_string(image.width()) + ' ' + std::to_string(image.height()) + ' ' +
                     std::to_string(image.channels()) + '\n';
  const std::size_t head = text.size();
  const std::size_t bytes = image.pixels().size() * sizeof(float);
  text.resize(head + bytes);
  std::memcpy(text.data() + head, image.pixels().data(), bytes);
  return text;
}

Image unpacked_image(std::string_view text, const Limits& limits) {
  std::array<int, 3> sizes = {};  // width, height, channels
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto read = std::from_chars(at, end, sizes[i]);
    const char separator = i + 1 < sizes.size() ? ' ' : '\n';
    if (read.ec != std::errc{} || read.ptr == end || *read.ptr != separator) sizes[i] = 0;
    at = std::min(read.ptr + 1, end);
  }
  const auto [width, height, channels] = sizes;
  const double pixels = static_cast<double>(width) * height;
  if (width < 1 || height < 1 || (channels != 3 && channels != 4) ||
      pixels > static_cast<double>(limits.measured_image_pixels)) {
    throw Error(ErrorCode::internal, "the image reader's answer has no head");
  }
  Image image(width, height, channels);
  const std::string_view rest(at, static_cast<std::size_t>(end - at));
  if (rest.size() != image.pixels().size() * sizeof(float))
    throw Error(ErrorCode::internal, "the image reader's answer has another length");
  std::memcpy(image.pixels().data(), rest.data(), rest.size());
  return image;
}

}  // namespace fstop::api
