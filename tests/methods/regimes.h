#pragma once

#include <string>
#include <vector>

#include "core/render/simulation.h"
#include "core/scene/scene.h"

namespace fstop {

/// A corner of what may be asked for, where methods tend to fail.
struct Regime {
  std::string name = {};
  Scene scene = {};
  SimulationSpec spec = {};
};

/// Macro, focus at infinity and just outside f, f/0.5 to f/256, blur of 0.1 to 500 pixels, edges in
/// depth, thin foregrounds, mirrors of what is out of focus, bright points, scenes of millimetres
/// and of kilometres, grazing surfaces, pictures of one pixel, coordinates beyond 16 bits.
/// `width` pixels wide (3:2), except where the regime itself says how large.
std::vector<Regime> stability_regimes(int width, double max_error);

}  // namespace fstop
