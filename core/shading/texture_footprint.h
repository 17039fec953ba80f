#pragma once

#include "core/shading/illumination.h"

namespace fstop {

/// Puts the lanes whose objects' textures are fixed to the picture where their samples lie on the
/// film: u, v, and a footprint of the film's lookup width at a uv_per_metre of 1.
void place_on_film(const ShadingInputs& in, const RayPacket& packet, LaneSurfaces& surfaces,
                   LaneFloats& footprint) noexcept;

/// An ellipse of texels: the width and direction of its longer axis, and the shorter's width.
struct TexelEllipse {
  float major = 0.0F;
  float minor = 0.0F;
  float major_u = 1.0F;  // unit, in texels along u and v
  float major_v = 0.0F;
};

/// The ellipse with matrix M = [[uu, uv], [uv, vv]], the squares of its widths M's eigenvalues.
TexelEllipse ellipse_of(float uu, float uv, float vv) noexcept;

/// A lookup takes at most as many probes; longer ellipses are widened.
inline constexpr int kMostProbes = 16;

/// Colours of an anisotropic texture: a disc of `footprint` metres across the ray falls onto the
/// surface, and into the texture, as an ellipse,
///
///     M = w^2 J (P + d' d'^T/cos^2) J^T,   d' = P d, P = 1 - n n^T, J = (grad u, grad v) in texels
///
/// over whose longer axis the mean of major/minor trilinear lookups, at most kMostProbes, is taken.
/// d the ray's direction, n the face's normal, cos = |n.d|, at least 1/64.
/// Source: Heckbert 1989 (the ellipse); McCormack et al. 1999 (probes along its axis).
void sample_anisotropic(const RayScene& scene, const Texture& texture, const LaneMask& lanes,
                        const RayPacket& packet, const LaneSurfaces& surfaces,
                        const LaneFloats& footprint, LaneColors& colors) noexcept;

}  // namespace fstop
