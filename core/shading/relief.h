#pragma once

#include "core/scene/ray_scene.h"

namespace fstop {

/// Tilts the shading normals n of surfaces with a bump map of heights h, a normal map (x, y, z), or
/// both, seen from the side that the winding's normal points to:
///
///     n' along z n + x t + y b - z (grad h - n (n . grad h)),   grad h = h_u grad u + h_v grad v
///     t along grad v x n, b along n x t, turned so that u grows along t and v along b
///
/// From behind the whole n' is turned: what stands out in front is a dent behind. Where there is no
/// tilt n stays as it is to the bit; where uv has no direction on the surface, there is none.
/// h_u and h_v are differences of lookups half a footprint, and at least half a texel, to either
/// side: `footprint` metres are averaged over, lane by lane. Slopes are cut at 1e6.
/// Valid: slopes of heights much smaller than the surface's own curvature radius; the outline stays
/// that of the smooth surface, and nothing casts a shadow on itself.
/// Source: Blinn 1978; Mikkelsen 2010 (surface gradient); Khronos glTF 2.0, 3.9.3 (normal map).
void add_relief(const RayScene& scene, const LaneFloats& footprint,
                LaneSurfaces& surfaces) noexcept;

}  // namespace fstop
