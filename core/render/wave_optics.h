#pragma once

#include <optional>
#include <string>

#include "core/optics/aperture.h"
#include "core/optics/diffraction.h"
#include "core/post/wave_transfer.h"
#include "core/render/method.h"

namespace fstop {

/// A camera's pupil as waves see it: what turns a depth into a defocus and a point spread.
class WaveOptics {
 public:
  explicit WaveOptics(const Shot& shot);

  /// U = k a^2 (1/z + 1/u - 1/f) at the reference wavelength for a point at `depth`, metres along
  /// the axis; infinity is legal. The same for all depths where defocus is switched off.
  double defocus(double depth) const noexcept {
    return defocus_at_infinity_ + (depth_matters_ ? defocus_per_vergence_ / depth : 0.0);
  }
  /// Signed diameter in pixels of the geometric disc at defocus U; the sign is that of U.
  double disc_px(double defocus) const noexcept { return defocus * px_per_defocus_; }
  double defocus_of_px(double disc_px) const noexcept { return disc_px / px_per_defocus_; }

  /// The pupil at defocus U.
  CircularPupil pupil(double defocus) const noexcept;
  const PictureLight& light() const noexcept { return light_; }
  const Aperture& aperture() const noexcept { return aperture_; }
  bool is_pinhole() const noexcept { return is_pinhole_; }
  /// Size of the picture over that of the image at the pupil's image distance.
  double scale() const noexcept { return scale_; }
  double image_distance() const noexcept { return image_distance_; }  // metres
  double pixel_pitch() const noexcept { return pixel_pitch_; }        // metres
  /// Share of each channel's light beyond r: halo_px / r, far from the centre, in pixels.
  std::array<double, 3> halo_px() const noexcept;
  /// lambda N_w / pitch at the camera's wavelength.
  double q() const noexcept { return q_; }

  /// Why waves cannot be computed for this pupil; empty if they can.
  std::string refusal() const;

 private:
  PictureLight light_;
  Aperture aperture_;
  bool is_pinhole_;
  bool depth_matters_;
  double diameter_;
  double image_distance_;
  double pixel_pitch_;
  double scale_;
  double q_;
  double reference_wavelength_;
  double defocus_at_infinity_;
  double defocus_per_vergence_;
  double px_per_defocus_;
};

}  // namespace fstop
