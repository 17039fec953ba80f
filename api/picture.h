#pragma once

#include <string_view>
#include <vector>

#include "core/encode/image_codec.h"
#include "core/render/simulation.h"

namespace fstop::api {

/// The outputs to compute for a request that asked for `asked`: EXR always carries depth and coc
/// (one centre ray each pixel). An id says nothing of the format, so whoever keeps a result for
/// other formats computes what EXR needs: layers_needed(ImageFormat::exr, asked).
std::vector<Output> layers_needed(ImageFormat format, const std::vector<Output>& asked);

/// The photograph as one file of `format`. With alpha: EXR holds R,G,B multiplied by A, as it
/// prescribes; PNG, WebP and TIFF straight colours, divided by A, and A. The 8-bit kinds are
/// halftoned where that is asked for, since EXR and TIFF are data: R,G,B, then the layers it has,
/// Z; coc.signed; N.X,N.Y,N.Z; var.R,var.G,var.B; aif.R,aif.G,aif.B; A; dist.ray; coc.diameter;
/// mask.valid; and as attributes the camera, the seed, `id`, the engine. Throws:
/// Error{unsupported} for a JPEG of a photograph with alpha.
Picture picture_of(const Photograph& photograph, const SimulationSpec& spec, std::string_view id,
                   ImageFormat format);

/// Colours and, unless it is empty, their alpha, as picture_of() has both: `color` is multiplied by
/// `alpha`, 1 channel. Throws: Error{unsupported} for JPEG with alpha.
Picture color_picture(const Image& color, const Image& alpha, ImageFormat format);

/// One output alone, first and only layer; the same attributes.
/// Throws: Error{not_found} if the photograph does not have it.
Picture output_picture(const Photograph& photograph, Output output, const SimulationSpec& spec,
                       std::string_view id);

}  // namespace fstop::api
