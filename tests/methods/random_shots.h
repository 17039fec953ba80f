#pragma once

#include <cstdint>
#include <string>

#include "core/render/simulation.h"
#include "core/scene/scene.h"

namespace fstop {

/// A photograph drawn at random: what is in front of which camera, and how wrong it may be.
struct RandomShot {
  std::uint32_t seed = 0;
  Scene scene = {};
  SimulationSpec spec = {};
  std::string what = {};  // a line for tables: camera and what the scene holds
};

/// The shot of `seed`, 96 x 64 pixels, the same on every machine:
///
/// a wall, a background or both; cards, spheres and small meshes in front, unlit or lit, plain or
/// with a checker, noise or smooth texture under some filter; with some probability thin bars near
/// the lens, a mirror, a thin sheet, glass, an area light, motion, small bright spheres. Lenses of
/// 24 to 135 mm, f/1.4 to f/32, focused from close to infinity, discs and blades, one pinhole in
/// ten; max_error 0.003 to 0.05, evenly by its logarithm.
///
/// Diffraction is `automatic` in two cases of five, else off.
RandomShot random_shot(std::uint32_t seed);

}  // namespace fstop
