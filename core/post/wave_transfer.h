#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "core/optics/diffraction.h"
#include "core/optics/spectrum.h"
#include "core/post/polar_table.h"

namespace fstop {

/// The light that a picture's channels are made of.
struct PictureLight {
  bool monochromatic = false;  // every channel at `wavelength`; else SpectralBands::sensor
  Length wavelength = Length::si(550e-9);

  friend bool operator==(const PictureLight&, const PictureLight&) = default;
};

/// A function of the frequency's magnitude on an even grid, linear between its points, 0 beyond.
class RadialTable {
 public:
  RadialTable() = default;
  /// `values[i]` at i * step, cycles per metre.
  RadialTable(double step, std::vector<float> values);

  /// The same less `amplitude` exp(-frequency * decay), the transform of a far halo.
  RadialTable without_halo(double amplitude, double decay) const;

  float operator()(float frequency) const noexcept {
    const float place = frequency * per_step_;
    if (!(place < last_)) return 0.0F;
    const auto i = static_cast<std::size_t>(place);
    const float share = place - static_cast<float>(i);
    return values_[i] + share * (values_[i + 1] - values_[i]);
  }

 private:
  std::vector<float> values_ = {0.0F, 0.0F};
  float per_step_ = 0.0F;
  float last_ = 0.0F;
};

/// One term of a transfer function that changes over the field: at field position (X, Y) on the
/// screen at distance z, t = (X^2 + Y^2)/z^2, azimuth phi, and for frequencies of azimuth psi,
///
///     H = sum of T(|nu|) t^power [cos(2 m phi) cos(2 m psi) + sin(2 m phi) sin(2 m psi)],
///
/// power >= m. A lens has the term (0, 0) alone.
struct FieldTerm {
  int harmonic = 0;  // m
  int power = 0;

  friend bool operator==(const FieldTerm&, const FieldTerm&) = default;
};

/// What diffraction and defocus leave of each frequency of one layer of depth.
struct WaveTransfer {
  std::vector<FieldTerm> terms = {};
  std::vector<std::array<RadialTable, 3>> tables = {};  // per term, per channel
  std::vector<PolarTable> polygon = {};  // per channel: instead of the tables, for bladed pupils
  int wavelengths = 0;
  double spectral_error = 0.0;  // of H, by the number of wavelengths
  double field_error = 0.0;     // of H, by the number of field terms
  double model_error = 0.0;     // the largest WaveModelError::total() of any wavelength
};

struct WaveTransferSpec {
  CircularPupil pupil = {};
  Aperture aperture = {};
  PictureLight light = {};
  double scale = 1.0;              // of the picture over the image at the pupil's distance
  double highest_frequency = 0.0;  // cycles per metre of the picture that will be asked for
  double field_limit = 0.0;        // the largest t; 0 for a lens
  double tolerance = 0.001;        // of H: for wavelengths and field terms
  std::stop_token stop = {};       // once stopped, the rest comes out wrong but soon
};

/// The transfer tables of a pupil: Hopkins' integral at every wavelength, summed on a fixed
/// grid of frequencies; for a pinhole AstigmaticOtf's along and across the plane of incidence,
/// fitted over the field by least squares. Wavelengths and terms are added until `tolerance` holds
/// or 33 wavelengths, 16 terms are reached; the errors left are reported. A bladed pupil has
/// PolygonOtf's at as many wavelengths as the disc of its area needs, as the upright
/// picture has it. Throws: Error{outside_domain} where require_wave_model() refuses.
WaveTransfer wave_transfer(const WaveTransferSpec& spec);

/// Wavelengths and weights of a picture's channels, `intervals` + 1 of them (1 if monochromatic).
std::vector<SpectralSample> picture_wavelengths(const PictureLight& light, int intervals);

/// Mean wavelength of each channel.
std::array<double, 3> mean_wavelengths(const PictureLight& light);

}  // namespace fstop
