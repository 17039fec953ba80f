#pragma once

#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "core/render/depth_nodes.h"
#include "core/render/emitter_choice.h"
#include "core/render/wave_optics.h"

namespace fstop {

/// What the centre rays of a frame and its surroundings tell of defocus and occlusion.
struct WaveSurvey {
  Sensor sensor = {};             // the frame, wider by `guard` pixels on every side
  int guard = 0;                  // a multiple of kTile
  int light_reach = 0;            // pixels beyond the frame from where light matters, at most guard
  std::vector<double> seen = {};  // defocus of pixels that may send light, and of small objects
  std::vector<float> defocus = {};  // of every pixel of `sensor`; NaN: dark and infinitely far
  std::vector<char> mirrors = {};   // the pixel shows a mirror or something transparent
  EmitterChoice emitters = {};      // splatted, not seen by any of the rays
  std::uint64_t rays = 0;
};

/// Pixels beyond the frame from where light is kept: as far as blur and diffraction bring it within
/// the error that may be, at most half the frame's longer side.
int light_reach(const Shot& shot, const ShotFacts& facts, const WaveOptics& optics);

/// Traces one ray a pixel. The guard takes the largest geometric disc's radius and diffraction's
/// halo down to where what lies beyond matters little; at most half the frame's longer side.
WaveSurvey wave_survey(const Shot& shot, const ShotFacts& facts, const WaveOptics& optics,
                       const RunControl& run);

/// Where a picture needs the pupil sampled: light behind an edge in depth, light too defocused for
/// the nodes, mirrors.
struct VisibilityMask {
  int width = 0;  // of the frame, pixels
  int height = 0;
  std::vector<char> tiles = {};  // of the frame, row by row, kTile pixels a side
  double share = 0.0;            // of the frame's tiles
  double occluded_share = 0.0;   // of the frame's pixels, those near an edge in depth
  double beyond_share = 0.0;     // of the surveyed pixels, those too defocused for the nodes
  /// Transfer loss of edges in depth so fine that they are not in the mask, over the frame.
  double fine_edge_loss = 0.0;

  /// Whether the pixel lies in a tile of the mask.
  bool covers(int x, int y) const noexcept;
};

/// Edges are steps of over half a pixel in disc diameter between neighbours: behind a smaller
/// one at most a quarter of a pixel of a disc is hidden. An edge between discs of (signed) diameter
/// p behind and q in front hides light within |p - q|/2 of it, which spreads by |p|/2, q's by
/// |q|/2.
VisibilityMask visibility_mask(const WaveSurvey& survey, const WaveOptics& optics,
                               const DepthNodes& nodes);

}  // namespace fstop
