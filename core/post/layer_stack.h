#pragma once

#include <cstdint>

#include "core/film/image.h"
#include "core/post/composite.h"

namespace fstop {

/// Bounds of a layer's root-mean-square errors over its own pixels, values clipped to [0,1]: 0 for
/// what is exact.
struct LayerError {
  double color = 0.0;
  double alpha = 0.0;
};

enum class LayerOperation {
  over,     ///< Porter & Duff's
  overlay,  ///< overlay_where_not_zero
};

/// How a layer lies on what is beneath.
struct LayerPlace {
  LayerOperation operation = LayerOperation::over;
  double opacity = 1.0;  // both its colours and its alpha are multiplied by it; 0 to 1
  int left = 0;          // of its upper left pixel on the canvas; what lies outside is cut off
  int top = 0;
};

/// Layers put onto an empty canvas, the lowest first, with a bound of the error:
///
///     over     C = c + (1 - a) B:  E_C <= e + f max(B) + max(1 - a) E_B,  F_C <= f + max(1 - a)
///     F_B overlay  C = c or B:         E_C <= hypot(e, E_B) + sqrt(m),  F_C likewise
///
/// c, a: colour and alpha of the layer, with the errors e, f; B: what lay there, with E_B, F_B. The
/// first is C' - C = (c' - c) - (a' - a) B + (1 - a')(B' - B), where the dashed ones are computed,
/// and the triangle inequality; max(B) is 1 unless B is exact. `over`
/// scales what it covers, so that light beyond 1 does not stay clipped: pixels that are brighter
/// than 1 before they are scaled by what is neither 0 nor 1, or by what is not sure, are counted as
/// wholly wrong. m: the share of pixels on the fringe of a layer that has an error, where a sample
/// more may turn 0 into light.
/// Where each layer's errors hold with 95 %, those of n layers hold together with at least
/// 1 - 0.05 n (Boole), whatever their dependence.
class LayerStack {
 public:
  /// Throws: Error{outside_domain} unless both sides are positive.
  LayerStack(int width, int height);

  /// `layer`: 4 channels, of any size. Throws: Error{outside_domain} for other channels, or an
  /// opacity outside [0,1].
  void add(const Image& layer, const LayerError& error, const LayerPlace& place);

  /// What lies on the canvas now: 4 channels, premultiplied.
  const Image& layer() const noexcept { return canvas_; }
  /// At most 1 each.
  LayerError error() const noexcept;
  /// Share of pixels that are counted as wholly wrong: too bright, or fringe.
  double unsure_share() const noexcept { return unsure_; }

 private:
  void lay_over(const Image& placed, const LayerError& error);
  void overlay(const Image& placed, const LayerError& error);

  Image canvas_;
  LayerError error_ = {};
  double unsure_ = 0.0;
};

/// `layer` on a canvas of another size: its upper left pixel at (left, top), colours and alpha
/// multiplied by `opacity`, empty where it does not reach.
Image placed_layer(const Image& layer, int width, int height, const LayerPlace& place);

/// The errors of keyed(layer, key) where the colours' error is `color` RMSE of values up to white:
///
///     |d alpha| <= |d chroma|/softness <= 0.7299 |d colour|/softness,
///     |d layer| <= |d colour| + max(key) |d alpha|
///
/// 0.7299: the greatest singular value of the matrix (Cb, Cr) of Rec. 709. A hard edge has no
/// bound but 1 where the colours are not exact. Pixels beyond white, whose colours may be as far
/// off as they like, count as wholly wrong. `layer` has 3 or 4 channels.
LayerError keyed_error(const ChromaKey& key, const Image& layer, double color);

}  // namespace fstop
