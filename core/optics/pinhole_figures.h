#pragma once

#include <optional>
#include <string_view>

namespace fstop {

/// What a hole of diameter c sqrt(f' lambda) is worth by one criterion of sharpness. The figures
/// are the same for every f' and lambda when lengths are counted in sqrt(f' lambda).
enum class PinholeFigure {
  brightest,        ///< intensity on the axis over the incident, 4 sin^2(pi c^2/8)
  peak_per_energy,  ///< density on the axis for unit energy, in 1/(f' lambda)
  energy50,         ///< radius of half the light, in sqrt(f' lambda)
  energy80,         ///< radius of 80 % of the light
  mtf50,            ///< lowest frequency of 50 % contrast, in 1/sqrt(f' lambda)
  mtf10,            ///< lowest frequency of 10 % contrast
  line_spread,      ///< half the peak of a line's image: the area under the OTF over frequency
  fwhm              ///< full width at half of the axis's density
};

/// The figure of the criterion of that name in pinhole_criteria(); none for the historical
/// constants, which maximise nothing, and for unknown names.
std::optional<PinholeFigure> pinhole_figure(std::string_view criterion) noexcept;

/// Whether the best hole has the largest figure (true) or the smallest (a radius or width).
bool larger_is_better(PinholeFigure figure) noexcept;

/// The figure at c; monochromatic Fresnel theory, object at infinity.
/// Throws: Error{outside_domain} unless 0 < c <= 20 (N_F up to 100), and for `fwhm` where a ring
///         outshines the axis.
double figure_value(PinholeFigure figure, double c);

/// The c with the best figure between 1 and 2.4, where each has one optimum, to about 1e-7.
double best_coefficient(PinholeFigure figure);

/// Root mean square radius of the light within `window`, both in sqrt(f' lambda). Not a criterion:
/// the second moment grows without limit as the window does.
/// Throws: Error{outside_domain} unless 0 < c <= 20 and 0 < window <= 100.
double windowed_rms_radius(double c, double window);

}  // namespace fstop
