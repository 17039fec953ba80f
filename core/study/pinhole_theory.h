#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/geometry.h"
#include "core/optics/astigmatic_otf.h"
#include "core/optics/diffraction.h"
#include "core/units.h"

namespace fstop {

/// What light a picture's channel sees: one wavelength, or a channel of SpectralBands::sensor.
struct ChannelLight {
  int channel = 1;                        // red, green, blue
  std::optional<Length> wavelength = {};  // where all light has one
};

/// The transfer of a pinhole to one channel of a picture, from points of one depth around a chief
/// ray: the weighed sum of Hopkins' integrals at the channel's wavelengths, for the same frequency
/// on the sensor, times the pixel's box. Off axis, at theta from it, the zones number differently
/// along the picture's radius and across it,
///
///     U_r = U cos^3(theta),  U_t = U cos(theta),
///     s_r = nu_r lambda z/(a cos^3(theta)),  s_t = nu_t lambda z/(a cos(theta)).
///
/// Valid: as ObliquePinholePsf (oblique_pinhole.h).
class ChannelOtf {
 public:
  /// `field`: where the chief ray meets the sensor over the image distance, x and y of the raster.
  /// `pixel_pitch` may be 0: no box. Throws: as require_wave_model at any wavelength that counts;
  /// Error{outside_domain} for a lens off axis, a channel not in 0 to 2 or a negative pitch.
  ChannelOtf(const CircularPupil& pupil, const ChannelLight& light, Length pixel_pitch,
             Vec2 field = {});

  /// At a frequency in cycles per metre on the sensor, along x and y; signed.
  double operator()(Vec2 frequency) const noexcept;

  /// The lowest frequency along the unit vector `direction` at which the transfer has fallen to
  /// `contrast`, to 1e-9 of itself. Throws: Error{outside_domain} unless 0 < contrast < 1.
  Vergence frequency_of_contrast(double contrast, Vec2 direction = {1.0, 0.0}) const;

  /// The same for the transfer's mean over all directions: what a ring of a star shows.
  Vergence mean_frequency_of_contrast(double contrast) const;

 private:
  struct Line {
    AstigmaticOtf otf;
    double s_per_frequency = 0.0;  // lambda z/a
    double weight = 0.0;
  };
  Vergence first_frequency(const std::function<double(double)>& otf, double contrast) const;

  std::vector<Line> lines_;
  double pixel_pitch_;        // metres
  double finest_change_;      // 1/m: no slower than any feature of the transfer
  Vec2 radial_ = {1.0, 0.0};  // unit, of the picture's radius at the chief ray
  double cosine_ = 1.0;       // of theta
};

}  // namespace fstop
