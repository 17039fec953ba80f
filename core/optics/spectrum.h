#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "core/optics/diffraction.h"
#include "core/units.h"

namespace fstop {

/// How the channels of a picture see the spectrum. Light of equal energy at every wavelength.
enum class SpectralBands {
  /// A camera's filters as Gaussians: red 600 nm, green 540 nm, blue 465 nm, full widths at half
  /// maximum 80, 85 and 60 nm. A model, not a measurement; never negative.
  sensor,
  /// The CIE 1931 2-degree observer by the piecewise Gaussians of Wyman, Sloan and Shirley, J.
  /// Comput. Graph. Tech. 2 (2), 1 (2013), table 1, turned to linear Rec. 709 by the matrix of
  /// IEC 61966-2-1. The red channel is negative about 500 nm, outside the gamut.
  cie_1931
};

std::string_view name_of(SpectralBands bands) noexcept;

/// The range that the bands are summed over.
inline constexpr Length kShortestVisible = Length::si(360e-9);
inline constexpr Length kLongestVisible = Length::si(780e-9);

/// The CIE 1931 colour matching functions x, y, z at `wavelength`, Wyman et al. 2013; y is the
/// luminous efficiency.
std::array<double, 3> colour_matching(Length wavelength) noexcept;

/// Response of red, green and blue at `wavelength`, arbitrary scale; 0 outside the visible range.
std::array<double, 3> channel_response(SpectralBands bands, Length wavelength) noexcept;

/// One wavelength's share of each channel.
struct SpectralSample {
  Length wavelength = {};
  std::array<double, 3> weight = {};
};

/// `intervals` + 1 wavelengths, evenly spaced over the visible range, each channel's weights adding
/// up to 1: the trapezoidal rule, which for smooth bands that end at zero converges fast.
/// Throws: Error{outside_domain} unless 4 <= intervals <= 4096.
std::vector<SpectralSample> spectral_samples(SpectralBands bands, int intervals);

/// A point's image in the three channels, rotationally symmetric, each of unit energy.
struct PolychromaticProfile {
  std::vector<std::array<double, 3>> density = {};  // 1/m^2, at the radii asked for
  int wavelengths = 0;
  double spectral_error = 0.0;  // of the wavelengths' number, as a share of each channel's peak
  double model_error = 0.0;     // the largest WaveModelError of any wavelength
};

/// Intensities added on the fixed radii (metres): at one wavelength every ring has its own place.
/// The number of wavelengths is doubled from 17 until no value changes by more than `tolerance` of
/// its channel's largest; that change is reported, and bounds the error of the coarser sum.
/// Throws: Error{outside_domain} for a tolerance not in (0, 1), no radius, a negative one, or a
/// pupil
///         that require_wave_model() refuses at any wavelength; Error{over_budget} if 4097
///         wavelengths do not suffice.
PolychromaticProfile polychromatic_profile(const CircularPupil& pupil, SpectralBands bands,
                                           std::span<const double> radii, double tolerance);

}  // namespace fstop
