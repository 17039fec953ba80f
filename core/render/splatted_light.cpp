#include "core/render/splatted_light.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace fstop {
namespace {

constexpr std::uint32_t kFewestPoints = 256;
constexpr std::uint32_t kMostPoints = 1U << 20;

// A pixel of a disc shows at most this much more than white before its noise stops mattering.
constexpr double kVisibleLight = 2.0;

double clipped_square(float a, float b) {
  const double off =
      std::clamp(static_cast<double>(a), 0.0, 1.0) - std::clamp(static_cast<double>(b), 0.0, 1.0);
  return 0.25 * off * off;
}

}  // namespace

Splatting::Splatting(const Camera& camera, std::uint32_t seed, SampleSource& samples)
    : choice(emitter_choice(samples.scene, camera, static_cast<double>(samples.exposure))),
      source(splat_source(samples, choice, seed)) {
  samples.mask = choice.camera_mask;
}

// Light of an emitter that pixels can show, in pixels times value.
std::vector<SplatRange> SplattedLight::ranges(double goal_mse, double scale) const {
  std::vector<double> light;
  double all = 0.0;
  for (const SplattedEmitter& splatted : source_.choice.emitters) {
    const Rgb& radiance = source_.scene.emitters()[splatted.number].radiance;
    const double value = static_cast<double>(source_.exposure) *
                         static_cast<double>(std::max({radiance[0], radiance[1], radiance[2]}));
    const double sharp_area = 0.25 * 3.14159265358979 * splatted.sharp_px * splatted.sharp_px;
    const double spread = std::max(1.0, splatted.footprint_px());
    light.push_back(std::min(value * sharp_area, kVisibleLight * spread));
    all += light.back();
  }
  const double pixels = static_cast<double>(std::visit(
                            [](const auto& c) { return c.sensor().width; }, source_.camera)) *
                        std::visit([](const auto& c) { return c.sensor().height; }, source_.camera);
  std::vector<SplatRange> result;
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double wanted = scale * light[i] * all / (goal_mse * pixels);
    const auto bounded =
        static_cast<std::uint32_t>(std::clamp(wanted, double(kFewestPoints), double(kMostPoints)));
    result.push_back({.emitter = static_cast<std::uint32_t>(i), .count = std::bit_ceil(bounded)});
  }
  return result;
}

double SplattedLight::splat_once(const std::vector<SplatRange>& ranges, ReplicateFilm& film,
                                 const RunControl& run) {
  const RunControl silent{.stop = run.stop, .workers = run.workers};
  std::array<Image, kReplicates> images;
  for (std::uint32_t r = 0; r < kReplicates; ++r) {
    SplatImage light(film.grid().width, film.grid().height);
    rays_ += fstop::splat(source_, r, ranges, light, {}, silent);
    images[r] = image_of(light);
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < images[0].pixels().size(); ++i) {
    squares += clipped_square(images[0].pixels()[i], images[1].pixels()[i]);
  }
  const double mse = squares / static_cast<double>(images[0].pixels().size());
  for (int r = 0; r < kReplicates; ++r) {
    film.set_extra(r, std::move(images[static_cast<std::size_t>(r)]));
  }
  return mse;
}

void SplattedLight::splat(double goal_mse, double most_points, ReplicateFilm& film,
                          const RunControl& run) {
  if (source_.choice.emitters.empty()) return;
  // Nets need a small part of what independent points do.
  const auto points_of = [](const std::vector<SplatRange>& all) {
    double points = 0.0;
    for (const SplatRange& range : all) points += double(kReplicates) * range.count;
    return points;
  };
  double first = 1.0 / 64.0;
  while (first > 1e-12 && points_of(ranges(goal_mse, first)) > most_points) first *= 0.25;
  for (double scale = first;; scale *= 4.0) {
    const std::vector<SplatRange> next = ranges(goal_mse, scale);
    const double mse = splat_once(next, film, run);
    const double points = points_of(next);
    const bool all_full = std::ranges::all_of(
        next, [](const SplatRange& range) { return range.count >= kMostPoints; });
    if (mse <= goal_mse || all_full || 4.0 * points > most_points) return;
  }
}

}  // namespace fstop
