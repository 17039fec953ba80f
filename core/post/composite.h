#pragma once

#include <array>

#include "core/film/image.h"

namespace fstop {

// Layers have four channels: linear red, green and blue, multiplied by the fourth, alpha: the share
// of the pixel that they cover (Porter & Duff 1984). Colours may exceed 1, alpha lies in [0,1].
// All functions take layers of one size and throw Error{outside_domain} for others.

/// A layer of `color` (3 channels) and `alpha` (1 channel), which the colour is multiplied by
/// already if `is_premultiplied`, as a render is; a photograph's file usually is not. Alpha is
/// clipped to [0,1]; NaN is 0.
Image layer_of(const Image& color, const Image& alpha, bool is_premultiplied);

/// Covers all.
Image opaque_layer(const Image& color);

/// `top` over `bottom`: top + (1 - alpha of top) bottom, in all four channels. Associative; the
/// empty layer (all 0) is its identity on both sides.
/// Source: Porter & Duff 1984, table "over".
Image over(const Image& top, const Image& bottom);

/// `top` where one of its colours is not 0, else `bottom`: no edge is softer than a pixel.
Image overlay_where_not_zero(const Image& top, const Image& bottom);

/// What a key takes out: colours near `color` (linear).
struct ChromaKey {
  std::array<float, 3> color = {0.0F, 1.0F, 0.0F};
  double tolerance = 0.1;  // up to this distance of chroma a pixel is all backing
  double softness = 0.1;   // from there alpha rises to 1 over this distance; 0: a hard edge
};

/// The layer that stands before a backing of the key's colour:
///
///     alpha = clamp((d - tolerance)/softness, 0, 1),  d = |chroma of the pixel - chroma of the
///     key| layer = max(pixel - (1 - alpha) key, 0), alpha
///
/// chroma = (Cb, Cr) of Rec. 709's matrix on linear values, so that a mixture of subject and
/// backing lies as far from the key as the subject's share says. Exact for a subject F before the
/// backing K if tolerance = 0 and softness = |chroma F - chroma K|. A shadow that leaves the share
/// s of the backing's light moves its chroma by (1 - s) of the key's own: tolerate as much. Source:
/// Smith & Blinn 1996 for the equation; ITU-R BT.709 for the matrix.
Image keyed(const Image& color, const ChromaKey& key);

/// Distance of two linear colours in the plane (Cb, Cr).
double chroma_distance(const float* a, const float* b) noexcept;

/// The colours of a layer, as it stands before black.
Image color_of(const Image& layer);
Image alpha_of(const Image& layer);

}  // namespace fstop
