#include "core/render/depth_nodes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/optics/transfer.h"

namespace fstop {
namespace {

TEST(DepthNodes, PlanesAreNodesOfTheirOwn) {
  const DepthNodes nodes({-8.0, -8.0, 3.0, 3.0, 20.0}, 0.01, 24, 500.0);
  ASSERT_EQ(nodes.defocuses().size(), 3U);
  EXPECT_EQ(nodes.defocuses()[0], -8.0);
  EXPECT_EQ(nodes.defocuses()[1], 3.0);
  EXPECT_EQ(nodes.defocuses()[2], 20.0);
  EXPECT_EQ(nodes.place(3.0).first, 1);
  EXPECT_EQ(nodes.place(3.0).second, 0.0F);
  // Nothing is shared out between planes: what lies between goes to the nearer.
  EXPECT_EQ(nodes.place(-1.0).first, 1);
  EXPECT_EQ(nodes.place(-6.0).first, 0);
  EXPECT_EQ(nodes.place(-6.0).second, 0.0F);
}

// The claim the spacing rests on: between neighbouring nodes the interpolated OTF is within the
// tolerance of Hopkins' integral at every frequency.
TEST(DepthNodes, InterpolatedTransferKeepsTheTolerance) {
  std::vector<double> range;
  for (double u = -60.0; u <= 300.0; u += 0.5) range.push_back(u);
  for (const double tolerance : {0.01, 0.0025}) {
    const DepthNodes nodes(range, tolerance, 1000, 500.0);
    double worst = 0.0;
    for (double u = -59.9; u < 299.0; u += 0.731) {
      const DepthNodes::Place place = nodes.place(u);
      const auto i = static_cast<std::size_t>(place.first);
      ASSERT_LT(i + 1, nodes.defocuses().size());
      const double share = static_cast<double>(place.second);
      const DefocusOtf low(nodes.defocuses()[i]);
      const DefocusOtf high(nodes.defocuses()[i + 1]);
      const DefocusOtf exact(u);
      for (double s = 0.01; s < 2.0; s += 0.03) {
        const double mixed = (1.0 - share) * low(s) + share * high(s);
        worst = std::max(worst, std::abs(mixed - exact(s)));
      }
    }
    std::printf("tolerance %.4f: %zu nodes, worst %.4f\n", tolerance, nodes.defocuses().size(),
                worst);
    EXPECT_LE(worst, tolerance);
  }
}

TEST(DepthNodes, FarDefocusIsLeftToRays) {
  const DepthNodes limited({0.0, 100.0, 600.0}, 0.01, 24, 500.0);
  EXPECT_EQ(limited.defocuses().size(), 2U);
  EXPECT_LT(limited.place(600.0).first, 0);
  EXPECT_EQ(limited.nearest(600.0).first, 1);
  std::vector<double> range;
  for (double u = -200.0; u <= 200.0; u += 0.25) range.push_back(u);
  const DepthNodes few(range, 0.01, 9, 500.0);
  EXPECT_EQ(few.defocuses().size(), 9U);
  EXPECT_LT(few.place(190.0).first, 0);
  EXPECT_LT(few.place(-190.0).first, 0);
  EXPECT_GE(few.place(0.0).first, 0);
}

TEST(DepthNodes, SomethingIsAlwaysThere) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const DepthNodes none({nan}, 0.01, 24, 500.0);
  ASSERT_EQ(none.defocuses().size(), 1U);
  EXPECT_EQ(none.place(12.0).first, 0);
}

}  // namespace
}  // namespace fstop
