#include "core/post/point_spread_energy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/optics/bessel.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kNodes = 2 * kGauss16Nodes.size();
// 99 % of a triangle's light lies within v = 82 and the rim; of red light, at the shortest
// wavelength's scale, within 1.7 times that.
constexpr double kReach = 200.0;
constexpr double kPhaseOfPanel = 20.0;  // 1e-13, see gauss16()
// By doubling: 3e-5 of the radius for blades from 3 to 8, f/16 to f/1.4, and holes up to 52
// degrees, whose cut-off is an ellipse. Half as many err by 1e-3.
constexpr int kFewestDirections = 48;
constexpr double kRootSteps = 10.0;  // of rising_root

// The geometric rim in v = pi cut_off r, at the wavelength of the highest cut-off.
double rim(const PointSpread& spread) noexcept {
  return kPi * spread.cut_off() * geometric_radius(spread.spec()).si();
}

// The 16 nodes of [from, to] in rising order, and their weights.
struct Panel {
  std::array<double, kNodes> nodes = {};
  std::array<double, kNodes> weights = {};
};

Panel panel_of(double from, double to) noexcept {
  Panel panel;
  const double centre = 0.5 * (from + to);
  const double half = 0.5 * (to - from);
  constexpr std::size_t kHalf = kNodes / 2;
  for (std::size_t i = 0; i < kHalf; ++i) {
    panel.nodes[kHalf - 1 - i] = centre - half * kGauss16Nodes[i];
    panel.nodes[kHalf + i] = centre + half * kGauss16Nodes[i];
    panel.weights[kHalf - 1 - i] = panel.weights[kHalf + i] = half * kGauss16Weights[i];
  }
  return panel;
}

// Energy of a round image between the radii.
Channels ring_energy(const PointSpread& spread, double from, double to) {
  const Panel panel = panel_of(from, to);
  std::array<Channels, kNodes> density;
  spread.densities(panel.nodes, density);
  Channels sum = {};
  for (std::size_t i = 0; i < kNodes; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += 2.0 * kPi * panel.nodes[i] * panel.weights[i] * density[i][c];
    }
  }
  return sum;
}

// Energy within whole panels of a round image: [i] within i panels. Ends once every channel holds
// `fraction`.
std::vector<Channels> energy_within_panels(const PointSpread& spread, double width,
                                           double fraction) {
  std::vector<Channels> within = {Channels{}};
  const auto is_enough = [&] {
    const Channels& last = within.back();
    return std::all_of(last.begin(), last.begin() + spread.channels(),
                       [fraction](double energy) { return energy >= fraction; });
  };
  while (!is_enough()) {
    const double from = width * static_cast<double>(within.size() - 1);
    Channels next = ring_energy(spread, from, from + width);
    for (std::size_t c = 0; c < 3; ++c) next[c] += within.back()[c];
    within.push_back(next);
  }
  return within;
}

// The root of a function that rises from below zero at `low` to zero or more at `high`, by false
// position (Illinois) to 1e-12.
template <typename Function>
double rising_root(Function&& f, double low, double at_low, double high, double at_high) {
  for (int step = 0; step < 200 && high - low > 1e-12 * high; ++step) {
    const double guess = (low * at_high - high * at_low) / (at_high - at_low);
    const double middle = guess > low && guess < high ? guess : 0.5 * (low + high);
    const double value = f(middle);
    if (value == 0.0) return middle;
    if (value < 0.0) {
      low = middle;
      at_low = value;
      at_high *= 0.5;
    } else {
      high = middle;
      at_high = value;
      at_low *= 0.5;
    }
  }
  return 0.5 * (low + high);
}

std::vector<Channels> round_radii(const PointSpread& spread, std::span<const double> fractions) {
  const double width = 2.0 / spread.cut_off();  // v turns through 2 pi
  const std::vector<Channels> within =
      energy_within_panels(spread, width, *std::ranges::max_element(fractions));
  std::vector<Channels> radii;
  for (const double fraction : fractions) {
    Channels& radius = radii.emplace_back();
    for (std::size_t c = 0; c < static_cast<std::size_t>(spread.channels()); ++c) {
      std::size_t i = 1;
      while (within[i][c] < fraction) ++i;
      const double from = width * static_cast<double>(i - 1);
      const double before = within[i - 1][c] - fraction;
      radius[c] = rising_root([&](double r) { return before + ring_energy(spread, from, r)[c]; },
                              from, before, from + width, within[i][c] - fraction);
    }
  }
  return radii;
}

// The mean of the transfer over all directions on a grid of frequencies, to integrate over.
class MeanTransfer {
 public:
  explicit MeanTransfer(const PointSpread& spread) {
    const int panels = panel_count(spread);
    const double width = spread.cut_off() / panels;
    for (int i = 0; i < panels; ++i) {
      const Panel panel = panel_of(i * width, (i + 1) * width);
      for (std::size_t k = 0; k < kNodes; ++k) {
        frequencies_.push_back(panel.nodes[k]);
        Channels weighted = mean(spread, panel.nodes[k]);
        for (double& value : weighted) value *= panel.weights[k];
        weighted_.push_back(weighted);
      }
    }
  }

  double encircled(double radius, std::size_t channel) const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < frequencies_.size(); ++i) {
      sum += weighted_[i][channel] * bessel_j0_j1(2.0 * kPi * frequencies_[i] * radius).j1;
    }
    return 2.0 * kPi * radius * sum;
  }

  static int panel_count(const PointSpread& spread) noexcept {
    const double phase = 2.0 * kReach + 4.0 * rim(spread);
    return 1 + static_cast<int>(phase / kPhaseOfPanel);
  }
  // Directions of one period: the blades', or a quarter turn of an oblique pinhole's.
  static int period_count(const PointSpread& spread) noexcept {
    return spread.spec().aperture.blades == 0 ? 4 : spread.spec().aperture.blades;
  }
  static int direction_count(const PointSpread& spread) noexcept {
    return kFewestDirections + static_cast<int>(rim(spread) / period_count(spread));
  }

 private:
  static Channels mean(const PointSpread& spread, double frequency) noexcept {
    const int count = direction_count(spread);
    const double period = 2.0 * kPi / period_count(spread);
    Channels sum = {};
    for (int i = 0; i < count; ++i) {
      const double angle = period * (i + 0.5) / count;
      const auto value = spread.otf({frequency * std::cos(angle), frequency * std::sin(angle)});
      for (std::size_t c = 0; c < 3; ++c) sum[c] += value[c].real() / count;
    }
    return sum;
  }

  std::vector<double> frequencies_ = {};
  std::vector<Channels> weighted_ = {};
};

std::vector<Channels> other_radii(const PointSpread& spread, std::span<const double> fractions) {
  const MeanTransfer transfer(spread);
  const double farthest = (kReach + 1.5 * rim(spread)) / (kPi * spread.cut_off());
  std::vector<Channels> radii;
  for (const double fraction : fractions) {
    Channels& radius = radii.emplace_back();
    for (std::size_t c = 0; c < static_cast<std::size_t>(spread.channels()); ++c) {
      const auto excess = [&](double r) { return transfer.encircled(r, c) - fraction; };
      double low = 0.0;
      double high = 0.5 / spread.cut_off();
      double at_low = -fraction;
      double at_high = excess(high);
      while (at_high < 0.0 && high < farthest) {
        low = high;
        at_low = at_high;
        high *= 1.5;
        at_high = excess(high);
      }
      if (at_high < 0.0) {
        throw Error(ErrorCode::over_budget, "this share of the light reaches too far out");
      }
      radius[c] = rising_root(excess, low, at_low, high, at_high);
    }
  }
  return radii;
}

}  // namespace

std::vector<Channels> encircled_radii(const PointSpread& spread,
                                      std::span<const double> fractions) {
  const bool valid = std::ranges::all_of(
      fractions, [](double f) { return f > 0.0 && f <= kLargestEncircledFraction; });
  if (!valid) {
    throw Error(ErrorCode::outside_domain,
                "an encircled fraction must be above 0 and at most 0.99: the light outside a "
                "radius falls only as its inverse");
  }
  if (fractions.empty()) return {};
  return spread.is_round() ? round_radii(spread, fractions) : other_radii(spread, fractions);
}

double encircled_radii_cost(const PointSpread& spread, std::size_t fractions) noexcept {
  const double roots = kRootSteps * spread.channels() * static_cast<double>(fractions);
  if (spread.is_round()) {
    const double panels = (kReach + 1.2 * rim(spread)) / (2.0 * kPi);
    return (panels + roots) * kNodes * spread.density_cost(0.0);
  }
  // A Bessel function costs about four units.
  return static_cast<double>(MeanTransfer::panel_count(spread)) * kNodes *
         (MeanTransfer::direction_count(spread) * spread.otf_cost() + 4.0 * roots);
}

}  // namespace fstop
