#include "core/sampling/warp.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr int kBlades[] = {0, 3, 5, 6, 8};  // 0: disc
constexpr double kRotation = 0.4;
constexpr double kPi = std::numbers::pi;

// A regular polygon of n corners with the area of the unit disc: R^2 = 2 pi/(n sin(2 pi/n)).
double circumradius(int blades) {
  const double sector = 2.0 * kPi / blades;
  return std::sqrt(sector / std::sin(sector));
}

std::vector<Vec2> corners_of(int blades) {
  std::vector<Vec2> corners;
  for (int i = 0; i < blades; ++i) {
    const double angle = kRotation + 2.0 * kPi * i / blades;
    corners.push_back(
        {circumradius(blades) * std::cos(angle), circumradius(blades) * std::sin(angle)});
  }
  return corners;
}

// Its mean square radius, R^2 (2 + cos(2 pi/n))/6; 1/2 for the disc.
double mean_square_radius(int blades) {
  if (blades == 0) return 0.5;
  return std::pow(circumradius(blades), 2) * (2.0 + std::cos(2.0 * kPi / blades)) / 6.0;
}

// A uniform point of the unit square to a point of the pupil.
using Warp = std::function<Vec2(Vec2)>;

Warp pupil_warp(int blades) {
  return [warp = PupilWarp(corners_of(blades))](Vec2 square) {
    LaneValues x = {};
    LaneValues y = {};
    x.fill(square.x);
    y.fill(square.y);
    warp.apply(x, y);
    return Vec2{x[0], y[0]};
  };
}

// Where a point of the pupil lies among cells of equal area: the sector of one blade, how deep in
// it (the square of the distance along the apothem), and how far along its edge. All from the
// point's x and y alone.
struct Place {
  double sector = 0.0;  // [0, sectors)
  double depth = 0.0;   // [0, 1], 1 on the rim
  double along = 0.0;   // [0, 1]
};

constexpr int kDiscSectors = 12;

Place place_of(Vec2 point, int blades) {
  const int sectors = blades == 0 ? kDiscSectors : blades;
  const double angle = std::atan2(point.y, point.x) - kRotation;
  const double turn = angle / (2.0 * kPi) - std::floor(angle / (2.0 * kPi));
  const double sector = std::min(turn * sectors, sectors - 1e-9);
  if (blades == 0) {
    const double along = sector - std::floor(sector);
    return {.sector = sector, .depth = point.x * point.x + point.y * point.y, .along = along};
  }
  const double middle = kRotation + 2.0 * kPi * (std::floor(sector) + 0.5) / blades;
  const double apothem = circumradius(blades) * std::cos(kPi / blades);
  const double outwards = point.x * std::cos(middle) + point.y * std::sin(middle);
  const double across = point.y * std::cos(middle) - point.x * std::sin(middle);
  const double half_edge = outwards * std::tan(kPi / blades);
  const double depth = outwards / apothem;
  return {.sector = sector, .depth = depth * depth, .along = 0.5 + 0.5 * across / half_edge};
}

constexpr int kDepths = 6;
constexpr int kSteps = 4;
constexpr int kPoints = 20'000;  // at least 69 expected counts a cell

// The tail probability of chi-square over cells of equal area.
double uniformity(const Warp& warp, int blades, std::uint64_t seed) {
  const int sectors = blades == 0 ? kDiscSectors : blades;
  std::vector<double> hits(static_cast<std::size_t>(sectors * kDepths * kSteps), 0.0);
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 32) * 0x1p-32; };
  const auto cell = [](double value, int cells) {
    return std::clamp(static_cast<int>(value * cells), 0, cells - 1);
  };
  for (int i = 0; i < kPoints; ++i) {
    const double u = uniform();
    const Place place = place_of(warp({u, uniform()}), blades);
    const int index =
        (static_cast<int>(place.sector) * kDepths + cell(place.depth, kDepths)) * kSteps +
        cell(place.along, kSteps);
    hits.at(static_cast<std::size_t>(index)) += 1.0;
  }
  const double expected = kPoints / static_cast<double>(hits.size());
  EXPECT_GE(expected, 5.0);
  double chi_square = 0.0;
  for (const double h : hits) chi_square += (h - expected) * (h - expected) / expected;
  return oracle::chi_square_tail(chi_square, static_cast<int>(hits.size()) - 1);
}

constexpr std::uint64_t kSeeds[] = {1, 2, 3};
const double kSignificance =
    oracle::sidak_significance(static_cast<int>(std::size(kBlades) * std::size(kSeeds)));

TEST(PupilWarp, FillsDiscAndPolygonsUniformly) {
  for (const int blades : kBlades) {
    for (const std::uint64_t seed : kSeeds) {
      EXPECT_GT(uniformity(pupil_warp(blades), blades, seed), kSignificance) << blades;
    }
  }
}

// The commonest mistake, r = xi instead of sqrt(xi), gathers points in the centre.
TEST(PupilWarp, UniformityTestFailsForAWrongDensity) {
  const Warp disc = [](Vec2 square) {
    const double angle = 2.0 * kPi * square.y;
    return Vec2{square.x * std::cos(angle), square.x * std::sin(angle)};
  };
  EXPECT_LT(uniformity(disc, 0, 1), kSignificance);
  const auto corners = corners_of(5);
  const Warp pentagon = [&corners](Vec2 square) {
    const auto blade = static_cast<std::size_t>(square.x * 5);
    const Vec2 a = corners[blade];
    const Vec2 b = corners[(blade + 1) % 5];
    return (a + (b - a) * (square.x * 5 - static_cast<double>(blade))) * square.y;
  };
  EXPECT_LT(uniformity(pentagon, 5, 1), kSignificance);
}

// A smaller fault: a pupil 5 % too wide.
TEST(PupilWarp, UniformityTestFailsForAStretchedDisc) {
  const Warp stretched = [](Vec2 square) {
    const Vec2 point = disc_point(square);
    return Vec2{point.x * 1.05, point.y};
  };
  EXPECT_LT(uniformity(stretched, 0, 1), kSignificance);
}

TEST(PupilWarp, StaysInsideThePupil) {
  // Also at the corners of the square; roundings and the cut sine series leave 1e-12.
  constexpr double kLast = 1.0 - 0x1p-32;
  for (const int blades : kBlades) {
    const Warp warp = pupil_warp(blades);
    for (int i = 0; i <= 64; ++i) {
      for (int k = 0; k <= 64; ++k) {
        const Vec2 point = warp({std::min(i / 64.0, kLast), std::min(k / 64.0, kLast)});
        ASSERT_LE(place_of(point, blades).depth, 1.0 + 1e-11) << blades << ": " << i << ", " << k;
      }
    }
  }
}

// Equal areas go to equal areas: the Jacobian is the pupil's area, pi, everywhere. Central
// differences with h = 1e-4 leave h^2 of the third derivatives, below 1e-6, away from the seams
// where the map bends.
TEST(PupilWarp, JacobianIsTheArea) {
  constexpr double kStep = 1e-4;
  for (const int blades : kBlades) {
    const Warp warp = pupil_warp(blades);
    for (const double u : {0.083, 0.21, 0.37, 0.47, 0.69, 0.93}) {
      for (const double v : {0.11, 0.29, 0.57, 0.89}) {
        const Vec2 along_u = warp({u + kStep, v}) - warp({u - kStep, v});
        const Vec2 along_v = warp({u, v + kStep}) - warp({u, v - kStep});
        const double area = along_u.x * along_v.y - along_u.y * along_v.x;
        EXPECT_NEAR(std::abs(area) / (4 * kStep * kStep), kPi, 1e-5)
            << blades << " blades at " << u << ", " << v;
      }
    }
  }
}

// The midpoint rule over 480 x 480 cells, whose borders are also the blades'. Along u the square of
// the radius bends by 2 (blades side)^2, at most 131 for the triangle, half of it on the average
// over v: 65/24/480^2 = 1.2e-5.
TEST(PupilWarp, MomentsAreThoseOfThePupil) {
  constexpr int kCells = 480;
  for (const int blades : kBlades) {
    const Warp warp = pupil_warp(blades);
    Vec2 mean;
    double square = 0.0;
    for (int i = 0; i < kCells; ++i) {
      for (int k = 0; k < kCells; ++k) {
        const Vec2 point = warp({(i + 0.5) / kCells, (k + 0.5) / kCells});
        mean = mean + point * (1.0 / (kCells * kCells));
        square += (point.x * point.x + point.y * point.y) / (kCells * kCells);
      }
    }
    EXPECT_NEAR(square, mean_square_radius(blades), 1.3e-5) << blades;
    EXPECT_NEAR(mean.x, 0.0, 1e-10) << blades;
    EXPECT_NEAR(mean.y, 0.0, 1e-10) << blades;
  }
}

TEST(PupilWarp, FirstVertexPointsWhereTheRotationSays) {
  for (const int blades : {3, 5, 6, 8}) {
    const double radius = circumradius(blades);
    const Vec2 tip = pupil_warp(blades)({0.0, 1.0 - 0x1p-32});
    // sqrt(1 - 2^-32) is short of 1 by 2^-33.
    EXPECT_NEAR(tip.x, radius * std::cos(kRotation), 2e-10);
    EXPECT_NEAR(tip.y, radius * std::sin(kRotation), 2e-10);
    // The second vertex lies from +x towards +y of it.
    const Vec2 second = pupil_warp(blades)({1.0 / blades, 1.0 - 0x1p-32});
    EXPECT_NEAR(second.x, radius * std::cos(kRotation + 2.0 * kPi / blades), 2e-10);
    EXPECT_NEAR(second.y, radius * std::sin(kRotation + 2.0 * kPi / blades), 2e-10);
  }
}

TEST(PupilWarp, LanesAreIndependentAndTheDiscIsDiscPoint) {
  const PupilWarp warp({});
  LaneValues x = {};
  LaneValues y = {};
  for (std::size_t i = 0; i < kLanes; ++i) {
    x[i] = (static_cast<double>(i) + 0.5) / kLanes;
    y[i] = 1.0 - (static_cast<double>(i) + 0.25) / kLanes;
  }
  const LaneValues u = x;
  const LaneValues v = y;
  warp.apply(x, y);
  for (std::size_t i = 0; i < kLanes; ++i) EXPECT_EQ((Vec2{x[i], y[i]}), disc_point({u[i], v[i]}));
}

// Squares around the centre become circles, their corners the diagonals, the middle stays.
TEST(DiscPoint, IsConcentric) {
  EXPECT_EQ(disc_point({0.5, 0.5}), (Vec2{0, 0}));
  for (const double half : {0.1, 0.3, 0.5}) {
    for (int i = 0; i <= 20; ++i) {
      const double t = half * (i / 10.0 - 1.0);
      for (const Vec2 side : {Vec2{half, t}, Vec2{-half, t}, Vec2{t, half}, Vec2{t, -half}}) {
        const Vec2 point = disc_point({0.5 + side.x, 0.5 + side.y});
        EXPECT_NEAR(std::hypot(point.x, point.y), 2.0 * half, 1e-12);
      }
    }
    const Vec2 corner = disc_point({0.5 + half, 0.5 + half});
    EXPECT_NEAR(corner.x, corner.y, 1e-12);
  }
}

}  // namespace
}  // namespace fstop
