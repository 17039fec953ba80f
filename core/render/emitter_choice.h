#pragma once

#include <cstdint>
#include <vector>

#include "core/camera/film_projection.h"
#include "core/scene/ray_scene.h"

namespace fstop {

/// An emitter that is splatted onto the film, and how it looks there.
struct SplattedEmitter {
  std::uint32_t number = 0;  // in RayScene::emitters()
  double depth = 0.0;        // of its middle, metres along the axis
  double sharp_px = 0.0;     // diameter of its sharp image, in pixels
  double blur_px = 0.0;      // diameter of a point's disc at its nearest or farthest point
  Vec2 raster = {};          // where its middle falls through the centre of the pupil
  /// Something else that is splatted, or a part of itself, may lie before it.
  bool may_be_hidden = false;

  /// About how many pixels its light is spread over.
  double footprint_px() const noexcept;
};

/// Which of a scene's emitters a camera splats; all others are left to camera rays.
struct EmitterChoice {
  /// Of rays that leave the pupil: without the splatted groups, all other bits set.
  std::uint32_t camera_mask = 0xffffffffU;
  std::vector<SplattedEmitter> emitters = {};  // to be splatted: those that can reach the film
  std::uint32_t found = 0;                     // emitters of the scene
  std::uint32_t bright = 0;  // of those, brighter than white in this exposure, maybe on the film
  std::uint32_t beyond = 0;  // of the splatted groups, those that cannot reach the film

  /// The groups that are splatted.
  std::uint32_t splat_mask() const noexcept { return ~camera_mask; }
};

/// Chooses groups of emitters to splat for a camera. `exposure` is the factor from radiance to
/// pixel value. A group is splatted if all its members that can reach the film lie before the
/// pupil as a whole; none has a sharp image over 16 pixels wide that is over half as wide as its
/// disc, which camera rays find by themselves; and one is brighter than white and small: its
/// sharp image is under 4 pixels wide or under half its disc. Members beyond the frame
/// and the widest disc, or behind the camera, are seen by no camera ray, so that masking them
/// changes nothing. Deterministic.
EmitterChoice emitter_choice(const RayScene& scene, const Camera& camera, double exposure);

/// The choice to splat nothing, with the numbers of emitters filled in.
EmitterChoice no_emitters(const RayScene& scene);

}  // namespace fstop
