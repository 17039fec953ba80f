#pragma once

#include "core/film/image.h"
#include "core/parallel.h"
#include "core/render/simulation.h"

namespace fstop {

/// Width in pixels that one sample's texture lookup averages over. The pixel's own average is
/// made of many samples; the narrower each lookup, the smaller the extra blur, which falls with
/// the width's square: an eighth of a pixel at max_error 0.01, less for smaller errors; or what
/// the request says.
double texture_lookup_width(const QualitySpec& quality);

/// Share of max_error that texture_detail_rmse mostly stays below, whatever max_error: 1/512 of an
/// rms Laplacian of 0.5, at 0.01.
inline constexpr double kTextureDetailShare = 0.1;

/// RMSE that averaging over `width` pixels in every lookup adds to `image`:
///
///     (sigma^2/2) rms(Laplacian),   sigma^2 = width^2/4
///
/// sigma^2 is the variance per axis of a mip level's box (1/12) and its bilinear tent (1/6).
/// Noise in the image raises it: an upper estimate.
double texture_detail_rmse(const Image& image, double width, const RunControl& run = {});

/// The same where lookups average over `disc_share` of each pixel's blur disc, or `width` pixels
/// if that is more. `coc`: signed diameters in pixels of what centre rays meet; a pixel counts by
/// the widest disc that may reach it. Throws: Error{cancelled}.
double texture_detail_rmse(const Image& image, double width, double disc_share, const Image& coc,
                           const RunControl& run = {});

}  // namespace fstop
