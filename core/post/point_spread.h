#pragma once

#include <array>
#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "core/optics/aperture.h"
#include "core/optics/diffraction.h"
#include "core/optics/spectrum.h"

namespace fstop {

/// Which point's image, through which pupil, in which light.
struct PointSpreadSpec {
  CircularPupil pupil = {};  // its diameter: of the disc of the aperture's area
  Aperture aperture = {};    // blades of a lens; a pinhole is round
  /// Radians from the axis, towards +x of the image. It changes a pinhole's image; the ideal thin
  /// lens's is the same everywhere.
  double field_angle = 0.0;
  Length wavelength = Length::si(550e-9);  // of the light, or what the RGB's regime refers to
  bool rgb = false;                        // three channels: SpectralBands::sensor
};

/// Radius of the first dark ring of the disc in focus, at `spec.wavelength`, on the axis.
Length airy_radius(const PointSpreadSpec& spec);

/// Radius of the rays' shadow or circle of confusion (corners of blades apart), on the axis.
Length geometric_radius(const PointSpreadSpec& spec) noexcept;

/// One value a channel; monochromatic light has the first alone.
using Channels = std::array<double, 3>;

/// One wavelength's share of the image; see point_spread.cpp.
struct PointSpreadComponent;

/// The image of a point on the sensor, unit energy in every channel, and its transform.
///
/// Coordinates: metres in the upright image, x right, y down, from where the chief ray arrives.
/// RGB adds the wavelengths that polychromatic_profile() found to suffice for the disc of the
/// pupil's area, on the axis.
/// Valid: as CircularPsf, PolygonPupil and ObliquePinholePsf: scalar waves, paraxial about the
///        chief ray, ideal lenses; error_bound() says what that costs.
class PointSpread {
 public:
  /// `largest_radius`: what density() serves of oblique pinholes. `spectral_tolerance`: of the
  /// number of wavelengths, as a share of each channel's peak.
  /// Throws: Error{outside_domain} with the reason where the wave model or one of the forms above
  ///         refuses, for a pinhole with blades, and for over 64 blades; Error{over_budget} where
  ///         RGB needs over 4097 wavelengths.
  explicit PointSpread(const PointSpreadSpec& spec, Length largest_radius,
                       double spectral_tolerance = 1e-3);
  ~PointSpread();
  PointSpread(PointSpread&&) noexcept;
  PointSpread& operator=(PointSpread&&) noexcept;
  PointSpread(const PointSpread&) = delete;
  PointSpread& operator=(const PointSpread&) = delete;

  const PointSpreadSpec& spec() const noexcept { return spec_; }
  int channels() const noexcept { return spec_.rgb ? 3 : 1; }
  /// Rotationally symmetric: a disc, and no oblique pinhole.
  bool is_round() const noexcept { return round_; }
  /// Whether otf() may have an imaginary part: odd blades out of focus.
  bool has_phase() const noexcept;
  int wavelengths() const noexcept;

  /// Energy per area, 1/m^2.
  Channels density(Vec2 point) const noexcept;
  /// The same at (radius, 0) for every radius >= 0 (metres). Spans of one size.
  void densities(std::span<const double> radii, std::span<Channels> result) const;
  /// H(nu) = integral of the density times exp(-2 pi i nu . r), nu in cycles/m; 1 at 0.
  std::array<std::complex<double>, 3> otf(Vec2 frequency) const noexcept;

  /// The frequency beyond which otf() is 0 in every direction and channel, cycles/m.
  double cut_off() const noexcept { return cut_off_; }
  /// N_F = |U|/2 pi on the axis, at spec().wavelength: twice the defocus in waves.
  double fresnel_number() const noexcept;
  DiffractionRegime regime() const noexcept;
  /// Relative L2 error of the waves' model, the largest of any wavelength.
  double model_error() const noexcept { return model_error_; }
  /// Error of the number of wavelengths, as a share of each channel's peak; 0 for one.
  double spectral_error() const noexcept { return spectral_error_; }
  double error_bound() const noexcept { return model_error_ + spectral_error_; }

  /// What a call costs, about: quadrature nodes, edges and series' terms of all wavelengths.
  double density_cost(double radius) const noexcept;
  double otf_cost() const noexcept;

 private:
  std::vector<SpectralSample> light(double spectral_tolerance);

  PointSpreadSpec spec_;
  bool round_ = true;
  double cut_off_ = 0.0;
  double model_error_ = 0.0;
  double spectral_error_ = 0.0;
  std::vector<PointSpreadComponent> components_;
};

}  // namespace fstop
