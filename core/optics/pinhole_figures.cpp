#include "core/optics/pinhole_figures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/optics/defocus_field.h"
#include "core/optics/encircled_energy.h"
#include "core/optics/quadrature.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLargestCoefficient = 20.0;

constexpr std::pair<std::string_view, PinholeFigure> kFigures[] = {
    {"brightest", PinholeFigure::brightest},
    {"peak-per-energy", PinholeFigure::peak_per_energy},
    {"energy50", PinholeFigure::energy50},
    {"energy80", PinholeFigure::energy80},
    {"mtf50", PinholeFigure::mtf50},
    {"mtf10", PinholeFigure::mtf10},
    {"line-spread", PinholeFigure::line_spread},
    {"fwhm", PinholeFigure::fwhm},
};

// With f' = lambda = 1: a = c/2, U = 2 pi N_F = pi c^2/2, v = pi c rho, s = 2 nu/c.
double defocus_of(double c) noexcept { return 0.5 * kPi * c * c; }
double radius_of(double v, double c) noexcept { return v / (kPi * c); }
double frequency_of(double s, double c) noexcept { return 0.5 * s * c; }

void require_coefficient(double c) {
  if (!(c > 0.0 && c <= kLargestCoefficient)) {
    throw Error(ErrorCode::outside_domain,
                "the pinhole's coefficient c must be above 0, at most 20");
  }
}

// The lowest s at which the OTF falls to `contrast`; steps are well below its finest ripple.
double reduced_frequency_of_contrast(double defocus, double contrast) {
  const DefocusOtf otf(defocus);
  const double step = std::min(0.01, 0.2 / (1.0 + defocus));
  double high = step;
  while (otf(high) > contrast) high += step;
  double low = high - step;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (otf(middle) > contrast ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double area_under_otf(double defocus) {
  const DefocusOtf otf(defocus);
  // s = 2 sin^2(t) smooths the half-integer power at the cut-off.
  const auto integrand = [&otf](double t) {
    const double sine = std::sin(t);
    return otf(2.0 * sine * sine) * 4.0 * sine * std::cos(t);
  };
  const int panels = 4 + static_cast<int>(defocus / 4.0);
  const double width = 0.5 * kPi / panels;
  double sum = 0.0;
  for (int i = 0; i < panels; ++i) sum += gauss16(i * width, (i + 1) * width, integrand);
  return sum;
}

}  // namespace

std::optional<PinholeFigure> pinhole_figure(std::string_view criterion) noexcept {
  const auto* found =
      std::ranges::find_if(kFigures, [&](const auto& entry) { return entry.first == criterion; });
  if (found == std::end(kFigures)) return std::nullopt;
  return found->second;
}

bool larger_is_better(PinholeFigure figure) noexcept {
  return figure != PinholeFigure::energy50 && figure != PinholeFigure::energy80 &&
         figure != PinholeFigure::fwhm;
}

double figure_value(PinholeFigure figure, double c) {
  require_coefficient(c);
  const double U = defocus_of(c);
  switch (figure) {
    case PinholeFigure::brightest:
      return U * U * DefocusField(U).intensity(0.0);
    case PinholeFigure::peak_per_energy:
      return kPi * c * c * DefocusField(U).intensity(0.0);
    case PinholeFigure::energy50:
      return radius_of(encircled_radius(DefocusField(U), 0.5), c);
    case PinholeFigure::energy80:
      return radius_of(encircled_radius(DefocusField(U), 0.8), c);
    case PinholeFigure::mtf50:
      return frequency_of(reduced_frequency_of_contrast(U, 0.5), c);
    case PinholeFigure::mtf10:
      return frequency_of(reduced_frequency_of_contrast(U, 0.1), c);
    case PinholeFigure::line_spread:
      return frequency_of(area_under_otf(U), c);
    case PinholeFigure::fwhm:
      return 2.0 * radius_of(half_maximum_radius(DefocusField(U)), c);
  }
  throw Error(ErrorCode::internal, "an unknown pinhole figure");
}

double best_coefficient(PinholeFigure figure) {
  const double sign = larger_is_better(figure) ? -1.0 : 1.0;
  const auto cost = [&](double c) { return sign * figure_value(figure, c); };
  double low = 1.0;
  double high = 2.4;
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double at_left = cost(left);
  double at_right = cost(right);
  while (high - low > 1e-7) {
    if (at_left < at_right) {
      high = std::exchange(right, left);
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = cost(left);
    } else {
      low = std::exchange(left, right);
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = cost(right);
    }
  }
  return 0.5 * (low + high);
}

double windowed_rms_radius(double c, double window) {
  require_coefficient(c);
  if (!(window > 0.0 && window <= 100.0)) {
    throw Error(ErrorCode::outside_domain, "the window must be above 0 and at most 100 radii");
  }
  const DefocusField field(defocus_of(c));
  const double reach = kPi * c * window;
  const int panels = 1 + static_cast<int>(reach / (2.0 * kPi));
  const double width = reach / panels;
  double moment = 0.0;
  for (int i = 0; i < panels; ++i) {
    moment += gauss16(i * width, (i + 1) * width,
                      [&field](double v) { return 2.0 * field.intensity(v) * v * v * v; });
  }
  return radius_of(std::sqrt(moment / encircled_energy(field, reach)), c);
}

}  // namespace fstop
