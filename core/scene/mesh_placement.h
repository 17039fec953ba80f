#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// Moves, turns and scales `mesh` as `placement` says; lengths of normals do not change.
/// Throws: Error{bad_geometry} for a mesh without vertices or extent.
void place(Mesh& mesh, const Placement& placement);

}  // namespace fstop
