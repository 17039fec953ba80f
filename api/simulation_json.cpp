#include "api/simulation_json.h"

#include <cmath>
#include <numbers>

#include "api/finishing_json.h"
#include "api/json_text.h"
#include "core/optics/pinhole.h"

namespace fstop::api {
namespace {

constexpr double kFarthestCoordinate = 1e7;  // metres
constexpr int kMostBlades = 64;
// Scalar diffraction theory, and with it every optimum, needs holes of many wavelengths.
constexpr double kLeastWavelengthsAcross = 10.0;
constexpr int kWebpSide = 16383;

constexpr Named<ImageFormat> kFormats[] = {{"png", ImageFormat::png},
                                           {"jpeg", ImageFormat::jpeg},
                                           {"webp", ImageFormat::webp},
                                           {"tiff", ImageFormat::tiff},
                                           {"exr", ImageFormat::exr}};
constexpr Named<Precision> kPrecisions[] = {{"single", Precision::single},
                                            {"half", Precision::half}};
constexpr Named<EffectChoice> kEffectChoices[] = {
    {"auto", EffectChoice::automatic}, {"on", EffectChoice::on}, {"off", EffectChoice::off}};
constexpr Named<Illumination> kIlluminations[] = {{"local", Illumination::local},
                                                  {"recursive", Illumination::recursive},
                                                  {"global", Illumination::global}};
constexpr Named<std::string_view> kMethods[] = {{"auto", "auto"},
                                                {"pinhole", "pinhole"},
                                                {"lens-reconstruction", "lens-reconstruction"},
                                                {"bokeh-splatting", "bokeh-splatting"},
                                                {"lens-sampling", "lens-sampling"},
                                                {"wave", "wave"},
                                                {"gather", "gather"}};
constexpr Named<SamplePattern> kPatterns[] = {{"low-discrepancy", SamplePattern::low_discrepancy},
                                              {"regular", SamplePattern::regular},
                                              {"jittered", SamplePattern::jittered},
                                              {"poisson", SamplePattern::poisson},
                                              {"poisson-disc", SamplePattern::poisson_disc}};
constexpr Named<bool> kSpectra[] = {{"rgb", false}, {"monochromatic", true}};

std::vector<Named<double>> criterion_coefficients() {
  std::vector<Named<double>> words;
  for (const PinholeCriterion& criterion : pinhole_criteria()) {
    words.push_back({criterion.name, criterion.coefficient});
  }
  return words;
}

// Of the focal length, by which the focused plane lies beyond it. Magnifications over a million
// turn roundings of the scene into whole pictures.
constexpr double kLeastBeyond = 1e-6;

LensSpec read_lens(ObjectReader& lens) {
  LensSpec spec;
  spec.lens.focal_length = lens.length("focal_length_mm", 1.0_mm, 2.0_m, 50.0_mm);
  spec.lens.f_number = lens.number("f_number", {0.5, 256.0}, 1.4);
  spec.focus_distance = lens.length("focus_distance_m", 0.01_m, kInfinitelyFar, 2.0_m);
  if (lens.clean() && spec.focus_distance <= spec.lens.focal_length) {
    lens.fault("focus_distance_m", "must exceed focal_length_mm, " +
                                       unit_of_suffix("_mm").text(spec.lens.focal_length));
  } else if (lens.clean() &&
             spec.focus_distance - spec.lens.focal_length < spec.lens.focal_length * kLeastBeyond) {
    lens.fault("focus_distance_m",
               "must exceed focal_length_mm by a millionth of it: the image would lie beyond a "
               "million focal lengths");
  }
  spec.aperture.blades = static_cast<int>(lens.integer("blades", 0, kMostBlades, 0));
  if (spec.aperture.blades == 1 || spec.aperture.blades == 2) {
    lens.fault("blades", "must be 0 (a disc) or lie in 3 to " + std::to_string(kMostBlades));
  }
  const double degrees = lens.number("blade_rotation_deg", {-360.0, 360.0}, 0.0);
  spec.aperture.rotation = degrees * (std::numbers::pi / 180.0);
  lens.reject_unread_members();
  return spec;
}

PinholeSpec read_pinhole(ObjectReader& pinhole, Length wavelength) {
  PinholeSpec spec;
  spec.image_distance = pinhole.length("image_distance_mm", 0.1_mm, 10.0_m, 50.0_mm);
  const nlohmann::json* diameter = pinhole.value("diameter_mm", false);
  const bool optimal = diameter != nullptr && is_word(*diameter, "optimal");
  if (optimal) {
    const double coefficient =
        pinhole.choice<double>("criterion", criterion_coefficients(), "brightest");
    spec.diameter = optimal_pinhole_diameter(spec.image_distance, wavelength, coefficient);
  } else {
    if (diameter != nullptr && !diameter->is_number()) {
      pinhole.fault("diameter_mm", "must be a number of millimetres or \"optimal\"");
    } else {
      spec.diameter = pinhole.length("diameter_mm", 0.001_mm, 100.0_mm, 0.35_mm);
    }
    if (pinhole.value("criterion", false) != nullptr) {
      pinhole.fault("criterion", "needs diameter_mm to be \"optimal\"");
    }
  }
  const Length least = kLeastWavelengthsAcross * wavelength;
  if (pinhole.clean() && spec.diameter < least) {
    pinhole.fault("diameter_mm", "must be at least 10 wavelengths, here " +
                                     unit_of_suffix("_mm").text(least) + "; it is " +
                                     unit_of_suffix("_mm").text(spec.diameter));
  }
  pinhole.reject_unread_members();
  return spec;
}

void read_pose(ObjectReader& camera, CameraSpec& spec) {
  spec.position = camera.vec3("position_m", kFarthestCoordinate, "m", spec.position);
  spec.look_at = camera.vec3("look_at_m", kFarthestCoordinate, "m", spec.look_at);
  spec.up = camera.vec3("up", 1e6, "", spec.up);
  if (!camera.clean()) return;
  const Vec3 sight = spec.look_at - spec.position;
  if (norm(sight) == 0.0) {
    camera.fault("look_at_m", "must differ from position_m");
  } else if (!(norm(cross(sight, spec.up)) > 1e-9 * norm(sight) * norm(spec.up))) {
    // As Pose::looking_at: below this sine the image's up is rounding noise.
    camera.fault("up", "must not be zero or parallel to the line of sight");
  }
}

// Left out of the normalised form where it is absent, so that older requests keep their ids.
void read_velocity(ObjectReader& camera, CameraSpec& spec) {
  if (camera.value("velocity_m_s", false) == nullptr) return;
  spec.velocity = camera.vec3("velocity_m_s", 1e5, "m/s", Vec3{});
}

void read_exposure(ObjectReader& camera, CameraSpec& spec) {
  spec.shutter_seconds = camera.number("shutter_s", {0.0, 1e5}, 0.0);
  const nlohmann::json* exposure = camera.value("exposure", false);
  if (exposure == nullptr || is_word(*exposure, "relative")) {
    camera.normalise("exposure", "relative");
  } else if (!exposure->is_object()) {
    camera.fault("exposure", "must be \"relative\" or an object {\"iso\": number}");
  } else {
    ObjectReader iso = camera.object("exposure");
    spec.exposure = IsoExposure{.iso = iso.number("iso", {1.0, 1e7})};
    iso.reject_unread_members();
    if (camera.clean() && !(spec.shutter_seconds > 0.0)) {
      camera.fault("shutter_s", "must be positive where exposure has an iso");
    }
  }
}

void read_optics(ObjectReader& camera, CameraSpec& spec) {
  const bool has_lens = camera.value("lens", false) != nullptr;
  const bool has_pinhole = camera.value("pinhole", false) != nullptr;
  if (has_lens == has_pinhole) camera.fault("needs exactly one of lens and pinhole");
  if (has_lens) {
    ObjectReader lens = camera.object("lens");
    spec.optics = read_lens(lens);
  }
  if (has_pinhole) {
    ObjectReader pinhole = camera.object("pinhole");
    spec.optics = read_pinhole(pinhole, spec.wavelength);
  }
  const bool breathing = camera.boolean("breathing", true);
  if (has_lens) {
    spec.breathing = breathing;
  } else {
    camera.leave_out("breathing");  // of lenses alone
  }
}

// Patterns are made for a known number of samples.
void read_sampling(ObjectReader& quality, QualitySpec& spec) {
  const nlohmann::json* member = quality.value("sampling", false);
  if (member == nullptr || member->is_null()) return quality.leave_out("sampling");
  ObjectReader sampling = quality.object("sampling");
  const auto pattern = [&](std::string_view key) {
    return sampling.choice<SamplePattern>(key, kPatterns, "low-discrepancy");
  };
  spec.sampling = {.pixel = pattern("pixel"), .lens = pattern("lens"), .time = pattern("time")};
  sampling.reject_unread_members();
  if (!quality.clean() || !spec.sampling.any()) return;
  if (!spec.samples || *spec.samples > kMostPatternSamples) {
    quality.fault("sampling", "needs samples, at most " + std::to_string(kMostPatternSamples) +
                                  ": a pattern is made for a number of them");
  }
}

}  // namespace

CameraSpec read_camera(ObjectReader& camera) {
  CameraSpec spec;
  read_pose(camera, spec);
  const std::array<Length, 2> sensor =
      camera.two_lengths("sensor_mm", 1.0_mm, 1000.0_mm, {36.0_mm, 24.0_mm});
  spec.sensor_width = sensor[0];
  spec.sensor_height = sensor[1];
  spec.wavelength = camera.length("wavelength_nm", 100.0_nm, 20000.0_nm, 550.0_nm);
  spec.monochromatic = camera.choice<bool>("spectrum", kSpectra, "rgb");
  read_optics(camera, spec);
  read_exposure(camera, spec);
  read_velocity(camera, spec);
  camera.reject_unread_members();
  return spec;
}

ImageSpec read_image(ObjectReader& image, const Limits& limits) {
  ImageSpec spec;
  spec.width = static_cast<int>(image.integer("width", 1, limits.image_side, 960));
  spec.height = static_cast<int>(image.integer("height", 1, limits.image_side, 640));
  spec.format = image.choice<ImageFormat>("format", kFormats, "png");
  spec.precision = image.choice<Precision>("precision", kPrecisions, "single");
  const bool floating = spec.format == ImageFormat::exr || spec.format == ImageFormat::tiff;
  if (image.clean() && spec.precision == Precision::half && !floating) {
    image.fault("precision", "may be \"half\" only where format is exr or tiff");
  }
  if (image.clean() && spec.format == ImageFormat::webp &&
      std::max(spec.width, spec.height) > kWebpSide) {
    image.fault("format",
                "cannot be webp: its sides end at " + std::to_string(kWebpSide) + " pixels");
  }
  spec.halftone = read_halftone(image, spec.width, spec.height, limits);
  image.reject_unread_members();
  return spec;
}

QualitySpec read_quality(ObjectReader& quality, const Limits& limits) {
  QualitySpec spec;
  spec.max_error = quality.number("max_error", {1e-6, 1.0}, spec.max_error);
  spec.max_time_ms = quality.optional_number(
      "max_time_ms", {1.0, static_cast<double>(limits.render_time.count())});
  spec.method = std::string(quality.choice<std::string_view>("method", kMethods, "auto"));
  if (const auto samples = quality.optional_integer("samples", 1, limits.samples_per_pixel)) {
    spec.samples = static_cast<int>(*samples);
  }
  read_sampling(quality, spec);
  spec.texture_width_px = quality.optional_number("texture_width_px", {0.0, 64.0});
  if (!spec.texture_width_px) quality.leave_out("texture_width_px");
  const bool has_discs = quality.has("texture_disc_share");
  spec.texture_disc_share = quality.number("texture_disc_share", {0.0, 0.5}, 0.0);
  if (!has_discs) quality.leave_out("texture_disc_share");
  quality.reject_unread_members();
  return spec;
}

EffectChoices read_effects(ObjectReader& effects) {
  const auto choice = [&](std::string_view key, std::string_view fallback) {
    return effects.choice<EffectChoice>(key, kEffectChoices, fallback);
  };
  EffectChoices choices;
  choices.defocus = choice("defocus", "auto");
  choices.diffraction = choice("diffraction", "auto");
  choices.motion = choice("motion", "auto");
  choices.falloff = choice("falloff", "off");
  effects.reject_unread_members();
  return choices;
}

Illumination read_illumination(ObjectReader& root) {
  const auto choice = root.choice<Illumination>("illumination", kIlluminations, "recursive");
  // Requests that never heard of it keep their ids.
  if (choice == Illumination::recursive) root.leave_out("illumination");
  return choice;
}

void require_square_pixels(ObjectReader& image, const ImageSpec& size, const CameraSpec& camera) {
  const double height = size.width * (camera.sensor_height / camera.sensor_width);
  try {
    sensor_of(camera, size.width, size.height);
  } catch (const Error&) {
    image.fault("must have square pixels: on this sensor " + std::to_string(size.width) +
                " pixels of width need " + number_text(height) + " of height, not " +
                std::to_string(size.height) + "; camera.sensor_mm gives it another shape");
  }
}

}  // namespace fstop::api
