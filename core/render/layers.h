#pragma once

#include "core/film/image.h"
#include "core/parallel.h"
#include "core/render/method.h"

namespace fstop {

/// What the centre ray of every pixel meets first, through the centre of projection.
struct GeometryLayers {
  Image depth;     // 1 channel: metres along the axis, infinity where nothing is
  Image distance;  // 1 channel: metres along the ray, infinity where nothing is
  Image coc;       // 1 channel: signed blur diameter in pixels of that depth, near negative
  Image normal;    // 3 channels: world, unit, on the camera's side; 0 where nothing is
};

/// Throws: Error{cancelled}.
GeometryLayers geometry_layers(const Shot& shot, const RunControl& run);

}  // namespace fstop
