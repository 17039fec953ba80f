#pragma once

#include <cstddef>

#include "core/render/bokeh_splatting.h"
#include "core/render/depth_nodes.h"
#include "core/render/light_layers.h"
#include "core/render/sample_loop.h"
#include "core/render/wave_optics.h"
#include "core/render/wave_survey.h"

namespace fstop {

/// Lays samples and splats down in the layers of their depth.
class LayerSink : public SampleSink, public SharpSplatSink {
 public:
  LayerSink(const WaveOptics& optics, const DepthNodes& nodes, const VisibilityMask& mask,
            const WaveSurvey& survey, LightLayers& layers)
      : optics_(optics),
        nodes_(nodes),
        mask_(mask),
        guard_(survey.guard),
        light_reach_(survey.light_reach),
        layers_(layers) {}

  void add(int left, int top, const LaneMask& valid, const TracedPacket& packet) override {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (valid[lane] == 0) continue;
      const Rgb light = packet.colors.get(static_cast<int>(lane));
      if (light == Rgb{0, 0, 0}) continue;
      const double x =
          left + static_cast<int>(lane) % kBlockSide + static_cast<double>(packet.jitter_x[lane]);
      const double y =
          top + static_cast<int>(lane) / kBlockSide + static_cast<double>(packet.jitter_y[lane]);
      lay_down(x, y, static_cast<double>(packet.depth[lane]), light);
    }
  }

  void add(const SharpSplat& splat) override {
    const auto x = static_cast<double>(splat.raster_x);
    const auto y = static_cast<double>(splat.raster_y);
    lay_down(x, y, static_cast<double>(splat.depth), splat.light);
    const Rgb& hidden = splat.hidden;
    if (hidden == Rgb{0, 0, 0}) return;
    lay_down(x, y, static_cast<double>(splat.depth_behind), {-hidden[0], -hidden[1], -hidden[2]});
  }

 private:
  void lay_down(double x, double y, double depth, const Rgb& light) {
    if (is_far_outside(x, y)) return;
    const double defocus = optics_.defocus(depth);
    DepthNodes::Place place = nodes_.place(defocus);
    if (place.first < 0) {
      if (shown_by_rays(x, y)) return;
      place = nodes_.nearest(defocus);  // so thin that the survey missed it
    }
    const float second = place.second;
    const float first = 1.0F - second;
    layers_.add(x, y, place.first, {first * light[0], first * light[1], first * light[2]});
    if (second == 0.0F) return;
    layers_.add(x, y, place.first + 1, {second * light[0], second * light[1], second * light[2]});
  }

  bool is_far_outside(double x, double y) const {
    const double left = x - guard_;
    const double top = y - guard_;
    return left < -light_reach_ || top < -light_reach_ || left > mask_.width + light_reach_ ||
           top > mask_.height + light_reach_;
  }

  // Outside the frame rays answer too: the mask reaches as far as light there does.
  bool shown_by_rays(double x, double y) const {
    const int column = static_cast<int>(x) - guard_;
    const int row = static_cast<int>(y) - guard_;
    if (column < 0 || row < 0 || column >= mask_.width || row >= mask_.height) return true;
    return mask_.covers(column, row);
  }

  const WaveOptics& optics_;
  const DepthNodes& nodes_;
  const VisibilityMask& mask_;
  int guard_;
  int light_reach_;
  LightLayers& layers_;
};

}  // namespace fstop
