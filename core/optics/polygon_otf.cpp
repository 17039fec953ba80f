#include "core/optics/polygon_otf.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/optics/defocus_field.h"

namespace fstop {
namespace {

// Below this no phase turns by a rounding.
constexpr double kNoPhase = 1e-100;
constexpr double kSmallestFrequency = 1e-150;

double sinc(double x) noexcept { return std::abs(x) < 1e-8 ? 1.0 : std::sin(x) / x; }

// sin(x)/x - 1 without cancellation.
double sinc_minus_one(double x) noexcept {
  if (std::abs(x) > 0.5) return std::sin(x) / x - 1.0;
  const double y = x * x;
  // To 1/13!: the rest is below 2^-53 of the sum.
  return -y / 6.0 *
         (1.0 -
          y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0 * (1.0 - y / 156.0)))));
}

// One side of the polygon between its lowest and its highest corner, eta rising: corners `first`,
// `first + step`, ... of the cycle.
struct Chain {
  const Vec2* corners = nullptr;
  int count = 0;  // of the whole polygon
  int at = 0;
  int step = 1;

  Vec2 start() const noexcept { return corners[at]; }
  Vec2 end() const noexcept {
    const int next = at + step;
    return corners[next == count ? 0 : next < 0 ? count - 1 : next];
  }
  void advance() noexcept {
    at += step;
    if (at == count) at = 0;
    if (at < 0) at = count - 1;
  }
  // xi of the edge at eta, which lies on it within rounding.
  double xi(double eta) const noexcept {
    const Vec2 a = start();
    const Vec2 b = end();
    return a.x + (b.x - a.x) * std::clamp((eta - a.y) / (b.y - a.y), 0.0, 1.0);
  }
};

struct Interval {
  double from = std::numeric_limits<double>::infinity();
  double to = -std::numeric_limits<double>::infinity();
};

// Where the chord between the chains is at least `length` long: one interval, as the polygon is
// convex; empty (from > to) where it never is.
Interval long_chords(Chain front, Chain back, int highest, double length) noexcept {
  Interval result;
  double from = front.start().y;
  while (front.at != highest && back.at != highest) {
    const double to = std::min(front.end().y, back.end().y);
    if (to > from) {
      const double excess_from = front.xi(from) - back.xi(from) - length;
      const double excess_to = front.xi(to) - back.xi(to) - length;
      const double crossing = from + (to - from) * (excess_from / (excess_from - excess_to));
      if (excess_from >= 0.0 || excess_to >= 0.0) {
        result.from = std::min(result.from, excess_from >= 0.0 ? from : crossing);
        result.to = std::max(result.to, excess_to >= 0.0 ? to : crossing);
      }
      from = to;
    }
    if (front.end().y <= from) front.advance();
    if (back.at != highest && back.end().y <= from) back.advance();
  }
  return result;
}

// Sum over the chain's edges within the interval, moved by `shift` along s, of d(eta) (mean of
// exp(-i omega xi) - 1); for omega = 0 the sum of -i xi d(eta), its limit over omega.
std::complex<double> edge_sum(Chain chain, int highest, Interval within, double shift,
                              double omega) noexcept {
  std::complex<double> sum = 0.0;
  for (; chain.at != highest; chain.advance()) {
    const double low = std::max(chain.start().y, within.from);
    const double high = std::min(chain.end().y, within.to);
    if (!(high > low)) continue;
    const double xi_low = chain.xi(low);
    const double xi_high = chain.xi(high);
    const double middle = 0.5 * (xi_low + xi_high) + shift;
    if (omega == 0.0) {
      sum += std::complex<double>(0.0, -middle * (high - low));
      continue;
    }
    const double half_turn = 0.5 * omega * (xi_high - xi_low);
    const double envelope = sinc(half_turn);
    const double sine = std::sin(0.5 * omega * middle);
    const double cosine = std::cos(0.5 * omega * middle);
    sum += (high - low) *
           std::complex<double>(sinc_minus_one(half_turn) - 2.0 * sine * sine * envelope,
                                -2.0 * sine * cosine * envelope);
  }
  return sum;
}

}  // namespace

PolygonOtf::PolygonOtf(const Aperture& aperture, double defocus)
    : blades_(aperture.blades), defocus_(defocus), circumradius_(0.0) {
  if (blades_ < 3 || blades_ > kMostBlades || !std::isfinite(aperture.rotation)) {
    throw Error(ErrorCode::outside_domain,
                "a polygon's OTF needs 3 to 64 blades and a finite rotation");
  }
  if (!(std::abs(defocus) <= kLargestDefocus)) {
    throw Error(ErrorCode::outside_domain,
                "the defocus |U| must be at most 10000 rad (1591 Fresnel zones or 796 waves)");
  }
  circumradius_ = aperture_circumradius(aperture);
  const std::vector<Vec2> corners = aperture_vertices(aperture);
  std::copy(corners.begin(), corners.end(), corners_.begin());
}

PolygonOtf::Corners PolygonOtf::turned(Vec2 direction) const noexcept {
  Corners result;
  for (std::size_t i = 0; i < static_cast<std::size_t>(blades_); ++i) {
    const Vec2 corner = corners_[i];
    result[i] = {corner.x * direction.x + corner.y * direction.y,
                 corner.y * direction.x - corner.x * direction.y};
  }
  return result;
}

std::complex<double> PolygonOtf::operator()(Vec2 s) const noexcept {
  const double frequency = std::hypot(s.x, s.y);
  if (frequency < kSmallestFrequency) return 1.0;
  if (frequency >= 2.0 * circumradius_) return 0.0;
  const Corners corners = turned({s.x / frequency, s.y / frequency});
  int lowest = 0;
  int highest = 0;
  for (int i = 1; i < blades_; ++i) {
    const auto at = [&corners](int j) { return corners[static_cast<std::size_t>(j)].y; };
    if (at(i) < at(lowest)) lowest = i;
    if (at(i) > at(highest)) highest = i;
  }
  // Counter-clockwise, eta rises along the edges that face +xi.
  const Chain front{corners.data(), blades_, lowest, 1};
  const Chain back{corners.data(), blades_, lowest, -1};
  const Interval overlap = long_chords(front, back, highest, frequency);
  if (!(overlap.to > overlap.from)) return 0.0;
  const double omega = defocus_ * frequency;
  const bool turns = std::abs(omega) > kNoPhase;
  const double used = turns ? omega : 0.0;
  const std::complex<double> sum = edge_sum(front, highest, overlap, -0.5 * frequency, used) -
                                   edge_sum(back, highest, overlap, 0.5 * frequency, used);
  // The polygon has the unit disc's area.
  const double scale = 1.0 / (std::numbers::pi * (turns ? omega : 1.0));
  return {-sum.imag() * scale, sum.real() * scale};
}

double PolygonOtf::cut_off(Vec2 direction) const noexcept {
  // The longest chord along a direction starts at a corner: concave in eta, with kinks there.
  const Corners corners = turned(direction);
  double longest = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(blades_); ++i) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(blades_); ++j) {
      const std::size_t next = (j + 1) % static_cast<std::size_t>(blades_);
      const Vec2 a = corners[j];
      const Vec2 b = corners[next];
      const double eta = corners[i].y;
      if (a.y == b.y || (eta - a.y) * (eta - b.y) > 0.0) continue;
      const double xi = a.x + (b.x - a.x) * ((eta - a.y) / (b.y - a.y));
      longest = std::max(longest, std::abs(xi - corners[i].x));
    }
  }
  return longest;
}

}  // namespace fstop
