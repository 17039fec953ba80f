#include "core/render/emitter_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fstop {
namespace {

constexpr double kSmallPx = 4.0;    // a sharp image that few samples of a pixel find
constexpr double kLargePx = 16.0;   // one over so many pixels that camera rays show it as well
constexpr double kWideShare = 0.5;  // of the disc's diameter: one of four camera rays finds it
// More pairs than these are not compared.
constexpr std::size_t kMostCompared = 4096;

enum class Place { before, beyond, across };

class Sight {
 public:
  explicit Sight(const FilmProjection& film) : film_(film) {}

  // Whether an emitter can reach the film, and whether all of it lies before the pupil.
  Place place(const Emitter& emitter) const {
    const Vec3 center = film_.world_from_camera.from_world(emitter.center);
    const double near = center.z - emitter.radius;
    const double far = center.z + emitter.radius;
    if (far <= 0.0) return Place::beyond;
    if (near <= 1e-6 * norm(center)) return Place::across;  // in doubt: not splatted
    const double reach = kFarthestCorner * film_.pupil_radius;
    const double spread = reach * std::max(std::abs(film_.vergence - 1.0 / near),
                                           std::abs(film_.vergence - 1.0 / far));
    const bool meets = meets_frame(center.x, emitter.radius, near, far, spread, film_.width) &&
                       meets_frame(center.y, emitter.radius, near, far, spread, film_.height);
    if (!meets) return Place::beyond;
    // Points of the pupil must lie outside it, with room for roundings.
    const bool touches = norm(center) <= emitter.radius * (1.0 + 1e-6) + reach;
    return touches ? Place::across : Place::before;
  }

  SplattedEmitter look(const Emitter& emitter, std::uint32_t number) const {
    const Vec3 center = film_.world_from_camera.from_world(emitter.center);
    const double near = center.z - emitter.radius;
    const double far = center.z + emitter.radius;
    return {.number = number,
            .depth = center.z,
            .sharp_px = 2.0 * emitter.radius * film_.scale / center.z,
            .blur_px = std::max(std::abs(film_.blur_px(near)), std::abs(film_.blur_px(far))),
            .raster = film_.raster(center, 0.0, 0.0)};
  }

 private:
  // Whether slopes of an interval, spread by the pupil, meet the frame along one axis.
  bool meets_frame(double middle, double radius, double near, double far, double spread,
                   int pixels) const {
    const double low = middle - radius;
    const double high = middle + radius;
    const double half = (0.5 * pixels + 1.0) / film_.scale;  // a pixel more for roundings
    return std::min(low / near, low / far) - spread <= half &&
           std::max(high / near, high / far) + spread >= -half;
  }

  const FilmProjection& film_;
};

// What is known of the members of a group.
struct GroupFacts {
  bool refused = false;  // a member cannot be splatted, or had better not be
  bool asked = false;    // a member is small and bright
};

// Distance of a point from the segment between the origin and `end`.
double distance_from_segment(Vec3 point, Vec3 end) {
  const double along = std::clamp(dot(point, end) / dot(end, end), 0.0, 1.0);
  return norm(point - end * along);
}

// Rays from the pupil to an emitter stay within a tube around the line to its centre, as wide as
// the wider of both ends: what does not enter it hides nothing.
void find_hidden(const RayScene& scene, const FilmProjection& film, EmitterChoice& choice) {
  std::vector<Vec3> centers;
  for (const SplattedEmitter& e : choice.emitters) {
    centers.push_back(film.world_from_camera.from_world(scene.emitters()[e.number].center));
  }
  const bool compares = centers.size() <= kMostCompared;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    SplattedEmitter& behind = choice.emitters[i];
    const Emitter& emitter = scene.emitters()[behind.number];
    const double tube = std::max(emitter.radius, kFarthestCorner * film.pupil_radius);
    const bool hides_itself = !emitter.triangles.empty() && !emitter.flat;
    behind.may_be_hidden = hides_itself || !compares;
    for (std::size_t j = 0; j < centers.size() && !behind.may_be_hidden; ++j) {
      if (j == i) continue;
      const double other = scene.emitters()[choice.emitters[j].number].radius;
      behind.may_be_hidden = distance_from_segment(centers[j], centers[i]) <= tube + other;
    }
  }
}

}  // namespace

double SplattedEmitter::footprint_px() const noexcept {
  const double wide = std::max({blur_px, sharp_px, 1.0});
  return 0.25 * std::numbers::pi * wide * wide;
}

EmitterChoice no_emitters(const RayScene& scene) {
  return {.found = static_cast<std::uint32_t>(scene.emitters().size())};
}

EmitterChoice emitter_choice(const RayScene& scene, const Camera& camera, double exposure) {
  const FilmProjection film(camera);
  const Sight sight(film);
  EmitterChoice choice = no_emitters(scene);
  std::array<GroupFacts, kEmitterGroups + 1> groups = {};
  std::vector<SplattedEmitter> seen;
  std::vector<int> beyond_of_group(kEmitterGroups + 1);
  for (std::uint32_t i = 0; i < choice.found; ++i) {
    const Emitter& emitter = scene.emitters()[i];
    GroupFacts& group = groups[static_cast<std::size_t>(emitter.group)];
    const Place place = sight.place(emitter);
    if (place == Place::beyond) {
      ++beyond_of_group[static_cast<std::size_t>(emitter.group)];
      continue;
    }
    const Rgb& light = emitter.radiance;
    const bool is_bright = exposure * double{std::max({light[0], light[1], light[2]})} > 1.0;
    choice.bright += is_bright ? 1U : 0U;
    if (place == Place::across) {
      group.refused = true;
      continue;
    }
    const SplattedEmitter look = sight.look(emitter, i);
    const bool is_large = look.sharp_px > kLargePx && look.sharp_px >= kWideShare * look.blur_px;
    const bool is_small = look.sharp_px < kSmallPx || look.sharp_px < kWideShare * look.blur_px;
    group.refused = group.refused || is_large;
    group.asked = group.asked || (is_small && is_bright);
    seen.push_back(look);
  }
  for (std::size_t g = 1; g < groups.size(); ++g) {
    if (groups[g].refused || !groups[g].asked) continue;
    choice.camera_mask &= ~(std::uint32_t{1} << g);
    choice.beyond += static_cast<std::uint32_t>(beyond_of_group[g]);
  }
  for (const SplattedEmitter& look : seen) {
    if ((scene.emitters()[look.number].mask() & choice.splat_mask()) != 0) {
      choice.emitters.push_back(look);
    }
  }
  find_hidden(scene, film, choice);
  return choice;
}

}  // namespace fstop
