#include "core/render/splatted_light.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace fstop {
namespace {

constexpr std::uint32_t kFewestPoints = 256;
constexpr std::uint32_t kMostPoints = 1U << 30;
constexpr double kLargestScale = 1e30;

// A pixel of a disc shows at most this much more than white before its noise stops mattering.
constexpr double kVisibleLight = 2.0;

// What is added to samples' light: it may be negative where little of an emitter hides much.
double clipped_square(float a, float b) {
  const double off =
      std::clamp(static_cast<double>(a), -1.0, 1.0) - std::clamp(static_cast<double>(b), -1.0, 1.0);
  return 0.25 * off * off;
}

}  // namespace

Splatting::Splatting(const Camera& camera, std::uint32_t seed, SampleSource& samples)
    : choice(emitter_choice(samples.scene, camera, static_cast<double>(samples.exposure))),
      source(splat_source(samples, choice, seed)) {
  samples.mask = choice.camera_mask;
}

std::vector<std::uint32_t> SplattedLight::counts(double goal_mse, double scale) const {
  std::vector<double> light;  // that pixels can show, in pixels times value
  double all = 0.0;
  for (const SplattedEmitter& splatted : source_.choice.emitters) {
    const Rgb& radiance = source_.scene.emitters()[splatted.number].radiance;
    const double value = static_cast<double>(source_.exposure) *
                         static_cast<double>(std::max({radiance[0], radiance[1], radiance[2]}));
    const double sharp_area = 0.25 * std::numbers::pi * splatted.sharp_px * splatted.sharp_px;
    const double spread = std::max(1.0, splatted.footprint_px());
    light.push_back(std::min(value * sharp_area, kVisibleLight * spread));
    all += light.back();
  }
  const double pixels = static_cast<double>(std::visit(
                            [](const auto& c) { return c.sensor().width; }, source_.camera)) *
                        std::visit([](const auto& c) { return c.sensor().height; }, source_.camera);
  std::vector<std::uint32_t> result;
  for (const double own : light) {
    const double wanted = scale * own * all / (goal_mse * pixels);
    result.push_back(std::bit_ceil(static_cast<std::uint32_t>(
        std::clamp(wanted, double(kFewestPoints), double(kMostPoints)))));
  }
  return result;
}

void SplattedLight::splat_to(const std::vector<std::uint32_t>& counts, const RunControl& run) {
  const RunControl silent{.stop = run.stop, .workers = run.workers};
  std::vector<SplatRange> growing, resting;
  bool any_doubled = false;
  for (std::uint32_t i = 0; i < counts.size(); ++i) {
    const std::uint32_t before = done_.empty() ? 0 : done_[i];
    if (counts[i] == kFewestPoints) {
      if (before == 0) resting.push_back({.emitter = i, .count = counts[i]});
    } else if (before <= kFewestPoints) {
      growing.push_back({.emitter = i, .count = counts[i]});
      // What it had among those at rest goes.
      if (before > 0) resting.push_back({.emitter = i, .count = before, .weight = -1.0});
    } else {
      growing.push_back({.emitter = i, .first = before, .count = before, .weight = 0.5});
      any_doubled = true;
    }
  }
  for (std::uint32_t r = 0; r < kReplicates; ++r) {
    if (any_doubled) {
      for (double& value : growing_[r].values()) value *= 0.5;
    }
    rays_ += fstop::splat(source_, r, growing, growing_[r], {}, silent);
    rays_ += fstop::splat(source_, r, resting, resting_[r], {}, silent);
  }
  done_ = counts;
}

// Puts the light into `film`.
double SplattedLight::measured_mse(ReplicateFilm& film) const {
  std::array<Image, kReplicates> images;
  for (std::size_t r = 0; r < kReplicates; ++r) {
    Image& image = images[r];
    image = Image(growing_[r].width(), growing_[r].height(), 3);
    std::ranges::transform(growing_[r].values(), resting_[r].values(), image.pixels().begin(),
                           [](double a, double b) { return static_cast<float>(a + b); });
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

double SplattedLight::splat(double goal_mse, double most_points, ReplicateFilm& film,
                            const RunControl& run) {
  if (source_.choice.emitters.empty()) return 0.0;
  const auto points_of = [](const std::vector<std::uint32_t>& all) {
    return double(kReplicates) * std::accumulate(all.begin(), all.end(), 0.0);
  };
  growing_.assign(kReplicates, SplatImage(film.grid().width, film.grid().height));
  resting_ = growing_;
  // Nets need a small part of what independent points do.
  double scale = 1.0 / 64.0;
  while (scale > 1e-12 && points_of(counts(goal_mse, scale)) > most_points) scale *= 0.5;
  std::vector<std::uint32_t> next = counts(goal_mse, scale);
  double mse = 0.0;
  for (;;) {
    splat_to(next, run);
    mse = measured_mse(film);
    if (mse <= goal_mse) break;
    // Emitters at the fewest points may need several doublings of their wishes to get more.
    std::vector<std::uint32_t> more = next;
    while (more == next && scale < kLargestScale) more = counts(goal_mse, scale *= 2.0);
    if (more == next || points_of(more) > most_points) break;
    next = std::move(more);
  }
  growing_.clear();
  resting_.clear();
  return mse;
}

}  // namespace fstop
