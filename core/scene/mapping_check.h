#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// Whether a material has a bump or a normal map.
bool gives_relief(const Material& material) noexcept;

/// Refuses what has no coordinates, or none that run over the surface where relief needs them.
/// Throws: Error{bad_geometry} as SurfaceMap does; for relief on the screen, and on a mesh that has
///         no texture coordinates of its own and no mapping.
void check_mapping(const Object& object, const Material& material);

}  // namespace fstop
