#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/scene/ray_scene.h"
#include "core/shading/illumination_choice.h"

namespace fstop {

/// A lamp and an object that turns its light: what forward paths begin with.
struct LightAim {
  std::uint32_t light = 0;   // index into Scene::lights
  std::uint32_t object = 0;  // index into Scene::objects, which mirrors or refracts
};

/// All pairs of them; none unless illumination is global. Such light no shadow ray finds: what
/// bends light blocks it, so that paths traced from the camera never see it.
std::vector<LightAim> light_aims(const RayScene& scene, Illumination illumination);

/// Aims rays from a lamp at all of an object: evenly over the cone of the ball about it, over all
/// directions from within that ball, or evenly over a quad that is seen from outside its ball.
class LightAimer {
 public:
  LightAimer(const RayScene& scene, const LightAim& aim, double shutter_seconds);

  /// Sets lane `lane` of `ray`, chosen by `way` and, on an area light, by `place`, both in the unit
  /// square, `seconds` after the shutter opened. Returns the solid angle that all such rays share
  /// (of directional light: the area across it, square metres) times f_angular.
  double aim(Vec2 way, Vec2 place, double seconds, int lane, RayPacket& ray) const;

 private:
  struct Ball {
    Vec3 center = {};
    double radius = 0.0;
  };
  struct BallOf;
  struct Aimed;
  static Ball ball_of(const Object& object);

  const Light& light_;
  const Object& object_;
  std::optional<QuadObject> quad_ = {};  // the object, where it is one
  Ball ball_ = {};                       // about the object
  Ball scene_ = {};                      // about all of them; for directional lights
};

}  // namespace fstop
