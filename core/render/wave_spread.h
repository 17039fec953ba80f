#pragma once

#include <array>
#include <vector>

#include "core/film/image.h"
#include "core/parallel.h"
#include "core/post/spectral_plane.h"
#include "core/post/wave_transfer.h"
#include "core/render/depth_nodes.h"
#include "core/render/light_layers.h"
#include "core/render/wave_optics.h"

namespace fstop {

/// Layers of sharp light as the film gets them: spread by diffraction and defocus, and, for
/// comparison with rays, by the geometric disc alone.
struct SpreadLight {
  Image waves = {};  // 3 channels, of the frame
  Image discs = {};  // the same; empty where it was not asked for
};

/// Light of layers, weighed: first * first_factor + second * second_factor.
struct LightSum {
  const LightLayers& first;
  float first_factor = 1.0F;
  const LightLayers* second = nullptr;
  float second_factor = 0.0F;
};

/// Convolves every layer with its own point spread, per channel, in the frequency domain.
///
/// Each point spread's transfer function is sampled as it is. Its far halo, density
/// halo_px/(2 pi (r^2 + b^2)^(3/2)), whose transform (halo_px/b) exp(-2 pi b nu) is known, is taken
/// out and spread on a coarse grid as wide as the light can go: what is left dies off within the
/// margin beyond the frame, so that nothing wraps round and no energy is lost.
class WaveSpreader {
 public:
  /// `width`, `height`: of the frame; the layers are wider by `guard` pixels on every side.
  struct Frame {
    int width = 0;
    int height = 0;
    int guard = 0;
    int cells = 1;        // along a pixel
    int light_reach = 0;  // pixels beyond the frame from where light is kept, at most `guard`
  };

  /// Throws: Error{outside_domain} as wave_transfer; Error{cancelled}.
  WaveSpreader(const WaveOptics& optics, const DepthNodes& nodes, const Frame& frame,
               double tolerance, const RunControl& run);

  SpreadLight spread(const LightSum& light, bool with_discs, const RunControl& run) const;
  /// `picture`, of the frame, 3 channels, as a pupil in focus spreads it: beyond the frame as at
  /// its border.
  Image spread_in_focus(const Image& picture, const RunControl& run) const;
  /// Waves as on the axis, all over the field: enough for noise.
  Image spread_roughly(const LightSum& light, const RunControl& run) const;

  /// The largest error of any layer's transfer function: of wavelengths and field.
  double transfer_error() const noexcept { return transfer_error_; }
  double tolerance() const noexcept { return tolerance_; }
  double field_error() const noexcept { return field_error_; }
  double model_error() const noexcept { return model_error_; }
  int wavelengths() const noexcept { return wavelengths_; }
  /// Elements of one transform.
  double plane_size() const noexcept { return static_cast<double>(plane_width_) * plane_height_; }

  /// Cells along a pixel: more for point spreads that are narrow, fewer for large pictures.
  static int cells_for(double q, int width, int height);
  /// About the elements of one transform: `largest_disc_px` of what waves show; others as Frame.
  static double plane_elements(double q, double largest_disc_px, int width, int height, int guard);
  /// Transforms above this are refused: twice the largest picture's.
  static constexpr double kMostPlaneElements = 6e7;
  /// Memory of a transform, all channels at once, or of large ones one by one; measured.
  static double plane_bytes(double elements) noexcept {
    constexpr double kEach = 120.0;
    constexpr double kEachOfLarge = 40.0;
    return elements * (elements > kLargePlane ? kEachOfLarge : kEach);
  }

 private:
  static constexpr double kLargePlane = 1.2e7;  // elements

  struct Region;
  class ChannelSum;
  class GroupSum;
  struct Wanted {
    bool discs = false;
    bool field = true;  // the terms beyond the first
  };

  SpreadLight spread(const LightSum& light, Wanted wanted, const RunControl& run) const;
  void spread_channels(const LightSum& light, Wanted wanted, int first, int count,
                       SpreadLight& result, const RunControl& run) const;
  Region whole() const;
  Region region(const LightSum& light, int layer) const;
  static void add_light(const LightSum& light, const Region& region, int layer, int channel,
                        ImageView<float> plane);

  void add_halo(const LightSum& light, int channel, int own, Image& halo) const;

  const WaveOptics& optics_;
  Frame frame_;
  std::vector<double> defocuses_;  // by layer
  int plane_width_ = 0;
  int plane_height_ = 0;
  double halo_radius_ = 0.0;  // b, pixels
  std::array<double, 3> halo_ = {};
  std::vector<WaveTransfer> transfers_;  // by layer, then that in focus
  std::vector<double> disc_radius_px_;
  double tolerance_;
  double transfer_error_ = 0.0;
  double field_error_ = 0.0;
  double model_error_ = 0.0;
  int wavelengths_ = 0;
};

}  // namespace fstop
