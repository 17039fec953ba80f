#include "api/psf_request.h"

#include <algorithm>
#include <numbers>

#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/simulation_json.h"

namespace fstop::api {
namespace {

constexpr int kDefaultPoints = 65;
constexpr int kDefaultSide = 256;
constexpr double kDefaultReach = 4.0;  // radii of Airy's pattern or of the rays' disc
constexpr double kLargestFrequency = 1e6;

constexpr Named<bool> kSpectra[] = {{"monochromatic", false}, {"rgb", true}};
constexpr Named<ImageFormat> kFormats[] = {{"png", ImageFormat::png},
                                           {"jpeg", ImageFormat::jpeg},
                                           {"webp", ImageFormat::webp},
                                           {"tiff", ImageFormat::tiff},
                                           {"exr", ImageFormat::exr}};
constexpr Named<PsfStretch> kStretches[] = {{"linear", PsfStretch::linear},
                                            {"square-root", PsfStretch::square_root},
                                            {"asinh", PsfStretch::asinh},
                                            {"log", PsfStretch::log}};

// The larger of Airy's and the rays' radius: what a sensible window is counted in.
Length spread_radius(const PointSpreadSpec& spec) {
  return std::max(airy_radius(spec), geometric_radius(spec));
}

CircularPupil pupil_of(const CameraSpec& camera, Length object_distance) {
  if (const auto* pinhole = std::get_if<PinholeSpec>(&camera.optics)) {
    return pinhole_pupil(pinhole->diameter, pinhole->image_distance, object_distance);
  }
  const auto& lens = std::get<LensSpec>(camera.optics);
  CircularPupil pupil = lens_pupil(lens.lens, lens.focus_distance, object_distance);
  // A lens that does not breathe has its image scaled to the focal length, blur and all.
  pupil.image_distance = sensor_distance(camera);
  return pupil;
}

Length default_object_distance(const CameraSpec& camera) {
  const auto* lens = std::get_if<LensSpec>(&camera.optics);
  return lens == nullptr ? kInfinitelyFar : lens->focus_distance;
}

// The elements of a list of plain numbers, each in `range`; none where the member is absent.
std::optional<std::vector<double>> numbers(ObjectReader& root, std::string_view key, Range range,
                                           int most) {
  const nlohmann::json* list = root.value(key, false);
  if (list == nullptr) return std::nullopt;
  std::vector<double> result;
  if (!list->is_array() || list->size() > static_cast<std::size_t>(most)) {
    root.fault(key, "must be an array of at most " + std::to_string(most) + " numbers");
    return result;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const nlohmann::json& element = (*list)[i];
    const double number = element.is_number() ? element.get<double>() : range.min - 1.0;
    if (!(number >= range.min && number <= range.max)) {
      root.fault_at(
          root.pointer(key) + '/' + std::to_string(i),
          "must be a number from " + number_text(range.min) + " to " + number_text(range.max));
    }
    result.push_back(number);
  }
  return result;
}

PsfImageSpec read_psf_image(ObjectReader& image, const Limits& limits, Length reach) {
  PsfImageSpec spec;
  spec.raster.width =
      static_cast<int>(image.integer("width", 1, limits.psf_image_side, kDefaultSide));
  spec.raster.height =
      static_cast<int>(image.integer("height", 1, limits.psf_image_side, kDefaultSide));
  const int side = std::max(spec.raster.width, spec.raster.height);
  const Length pitch = std::clamp(2.0 * kDefaultReach * reach / side, 0.001_um, 1.0_m);
  spec.raster.pitch = image.length("pixel_um", 0.001_um, 1.0_m, pitch);
  spec.format = image.choice<ImageFormat>("format", kFormats, "png");
  spec.stretch = image.choice<PsfStretch>("stretch", kStretches, "asinh");
  image.reject_unread_members();
  return spec;
}

std::vector<Length> default_radii(Length reach) {
  std::vector<Length> radii;
  for (int i = 0; i < kDefaultPoints; ++i) {
    radii.push_back(kDefaultReach * reach * (static_cast<double>(i) / (kDefaultPoints - 1)));
  }
  return radii;
}

}  // namespace

PsfRequest parse_psf_request(std::string_view body, const Limits& limits) {
  const nlohmann::json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  nlohmann::json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  ObjectReader camera_reader = root.object("camera");
  const CameraSpec camera = read_camera(camera_reader);
  PsfRequest request;
  PointSpreadSpec& spec = request.spec;
  request.object_distance =
      root.length("object_distance_m", 0.0001_m, kInfinitelyFar, default_object_distance(camera));
  spec.wavelength = root.length("wavelength_nm", 100.0_nm, 20000.0_nm, camera.wavelength);
  spec.rgb = root.choice<bool>("spectrum", kSpectra, "monochromatic");
  spec.field_angle =
      root.number("field_angle_deg", {-90.0, 90.0}, 0.0) * (std::numbers::pi / 180.0);
  request.radii =
      root.lengths("radii_um", Length{}, 1.0_m, static_cast<std::size_t>(limits.psf_points));
  request.frequencies =
      numbers(root, "frequencies_per_mm", {0.0, kLargestFrequency}, limits.psf_points);
  request.fractions = numbers(root, "fractions", {0.001, 0.99}, limits.psf_fractions)
                          .value_or(std::vector{0.5, 0.8, 0.838});
  const bool fills_radii = !root.has("radii_um");
  request.has_image = root.has("image");
  ObjectReader image = root.object("image");
  Length reach = 1.0_um;
  try {
    if (camera_reader.clean() && root.clean()) {
      spec.pupil = pupil_of(camera, request.object_distance);
      if (const auto* lens = std::get_if<LensSpec>(&camera.optics)) spec.aperture = lens->aperture;
      reach = spread_radius(spec);
      if (fills_radii) request.radii = default_radii(reach);
    }
  } catch (const Error&) {  // no optics for it; what is wrong with the rest is told first
    (void)read_psf_image(image, limits, reach);
    root.reject_unread_members();
    faults.throw_if_any();
    throw;
  }
  request.image = read_psf_image(image, limits, reach);
  root.reject_unread_members();
  faults.throw_if_any();
  if (request.frequencies) {
    for (double& frequency : *request.frequencies) frequency *= unit_of_suffix("_mm").per_metre;
  }
  return request;
}

}  // namespace fstop::api
