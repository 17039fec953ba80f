#include "server/cost_features.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <variant>

namespace fstop::server {
namespace {

// FNV-1a: the same in every process, as the table of measured costs needs (Fowler, Noll, Vo 1991).
std::uint64_t digest(std::string_view text) {
  std::uint64_t value = 0xcbf29ce484222325ULL;
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return value;
}

}  // namespace

std::uint64_t cost_kind(const SimulationSpec& spec) {
  std::string kind = spec.quality.method + '/';
  for (const EffectChoice effect :
       {spec.effects.defocus, spec.effects.diffraction, spec.effects.motion})
    kind += static_cast<char>('0' + static_cast<int>(effect));
  kind += static_cast<char>('0' + static_cast<int>(spec.illumination));
  const bool has_alpha = std::ranges::count(spec.outputs, Output::alpha) > 0;
  return digest(kind + (has_alpha ? "a" : ""));
}

CostFeatures cost_features(const SimulationSpec& spec, const std::string& scene_hash) {
  constexpr double kUsualBlur = 20.0;      // px
  constexpr double kLeastBlur = 0.05;      // px: less is none
  constexpr double kElementBytes = 120.0;  // of a transform, as transform_bytes() counts most
  const double pixels = static_cast<double>(spec.width) * spec.height;
  const double pitch_m = spec.camera.sensor_width.si() / spec.width;
  const double f_number = std::max(working_f_number(spec.camera), 1e-3);
  const double diffraction_px = spec.camera.wavelength.si() * f_number / pitch_m;
  CostFeatures f{.pixels = std::log(pixels / 4e4),
                 .error = std::log(std::max(spec.quality.max_error, 1e-6) / 0.01),
                 .f_number = std::log(f_number / 4.0),
                 .diffraction = std::log(diffraction_px),
                 .transform = std::log(transform_bytes(diffraction_px, spec.width, spec.height) /
                                       (kElementBytes * pixels)),
                 .is_pinhole = std::holds_alternative<PinholeSpec>(spec.camera.optics),
                 .is_twice = std::ranges::count(spec.outputs, Output::all_in_focus) > 0,
                 .kind = cost_kind(spec),
                 .scene = digest(scene_hash)};
  if (!f.is_pinhole) {
    const double blur_px = std::abs(blur_diameter(spec.camera, kInfinitelyFar).si()) / pitch_m;
    f.blur = std::log(std::max(kLeastBlur, blur_px) / kUsualBlur);
  }
  return spec.quality.samples ? with_forced_samples(f, static_cast<double>(*spec.quality.samples))
                              : f;
}

CostFeatures with_forced_samples(CostFeatures features, double samples) {
  features.error = 0.0;
  features.samples = std::log(samples / 8.0);
  features.is_forced = true;
  return features;
}

}  // namespace fstop::server
