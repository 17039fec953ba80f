#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// Quads alone: a textured wall at 6 m, three cards at 2 m and thirteen bars at 0.8 m, unlit.
Scene bench_slats();

/// About 100,000 triangles: spheres of triangles on a textured ground, one directional light.
Scene bench_mesh(ShadingModel model);

}  // namespace fstop
