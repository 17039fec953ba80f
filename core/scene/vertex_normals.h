#pragma once

#include "core/scene/scene.h"

namespace fstop {

/// `mesh` with vertex normals averaged from its faces, whatever normals it had. A corner's normal
/// is the mean of the normals of the faces that share its position and turn from its own face by at
/// most `crease_angle` (radians), each weighted by its angle at the vertex, so that triangulation
/// does not matter. Vertices on a crease are split: as many as there are different normals.
/// Positions are shared where they are equal to the bit, also between vertices that a seam of uv
/// separates.
///
/// Averages represent the surface as badly as its faces do: of a corrugated surface's vertices all
/// normals are alike, and it looks flat.
/// Faces without area have no say, and keep their geometric normal.
/// Throws: Error{bad_geometry} where more than kMostFacesOfAVertex faces meet.
/// Source: Gouraud 1971 (averages); Thuermer & Wuethrich 1998 (angle weights).
Mesh with_averaged_normals(const Mesh& mesh, double crease_angle);

inline constexpr std::size_t kMostFacesOfAVertex = 1024;

}  // namespace fstop
