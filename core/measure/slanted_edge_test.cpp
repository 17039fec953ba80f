#include "core/measure/slanted_edge.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/references/blurred_edge.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

SlantedEdge measured(const Image& image) {
  return measured_slanted_edge(image.view(), {.region = {0, 0, image.width(), image.height()}});
}

double largest_mtf_error(const SlantedEdge& edge, double radius, double angle, double up_to) {
  double worst = 0.0;
  for (std::size_t k = 0; k <= static_cast<std::size_t>(std::lround(100.0 * up_to)); ++k) {
    const double expected =
        std::abs(oracle::disc_pixel_otf(0.01 * static_cast<double>(k), radius, angle));
    worst = std::max(worst, std::abs(edge.mtf.at(k) - expected));
  }
  return worst;
}

// The radius of the disc whose MTF50, times the pixel's, is `mtf50`.
double radius_of_mtf50(double mtf50, double angle) {
  double low = 0.0, high = 40.0;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    const double there = oracle::first_frequency(
        [&](double nu) { return oracle::disc_pixel_otf(nu, middle, angle); }, 0.5);
    (there > mtf50 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::string reason_of_refusal(const Image& image, const SlantedEdgeSpec& spec) {
  try {
    measured_slanted_edge(image.view(), spec);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::outside_domain);
    return error.what();
  }
  return "measured";
}

// Tolerance: knots of 1/4 px pass 1 - 1.6e-4 at 1 cycle/px and fold back what the pixel's box and
// the disc leave about 4 cycles/px, under 1e-4 of it for R >= 0.25 px; the taper begins where a
// disc has ended. 5e-4 in all.
TEST(SlantedEdge, MtfOfADiscIsTheClosedForm) {
  double worst = 0.0;
  for (const double degrees : {2.0, 3.7, 5.0, 10.0, 22.0, 31.0, 40.0, 43.0}) {
    for (const double radius : {0.25, 0.5, 1.0, 3.0, 8.0, 20.0}) {
      const double angle = degrees * kDegree;
      const Image image = oracle::edge_picture({.angle = angle}, oracle::disc_profile(radius));
      const SlantedEdge edge = measured(image);
      const double error = largest_mtf_error(edge, radius, angle, 1.0);
      worst = std::max(worst, error);
      EXPECT_LT(error, 5e-4) << radius << " px at " << degrees << " degrees";
      EXPECT_NEAR(edge.slant, angle, 1e-5);
      EXPECT_NEAR(edge.levels.dark, 0.1, 1e-6);
      EXPECT_NEAR(edge.levels.bright, 0.8, 1e-6);
    }
  }
  std::printf("worst error of a disc's MTF up to 1 cycle/px: %.6f\n", worst);
}

// Where tan(slant) is a ratio of small whole numbers, pixels repeat each other's distances. The
// coarsest are 0.447 px apart; between them the profile is a cubic with the smallest bend, which
// passes sinc^4(0.447 nu) over its own alias: 1 - 0.012 at 0.6 cycles/px, 0.99 at 0.5.
TEST(SlantedEdge, RatiosOfSmallNumbersCostFineDetailAlone) {
  for (const double tangent : {1.0 / 2.0, 1.0 / 3.0, 2.0 / 3.0, 1.0 / 4.0, 3.0 / 4.0}) {
    for (const double radius : {0.25, 0.5, 3.0}) {
      const double angle = std::atan(tangent);
      const Image image = oracle::edge_picture({.angle = angle}, oracle::disc_profile(radius));
      EXPECT_LT(largest_mtf_error(measured(image), radius, angle, 0.6), 0.013)
          << radius << " px at " << tangent;
    }
  }
}

// An edge without any blur is the pixel's box: its MTF50 is 0.603 cycles/px for small slants.
TEST(SlantedEdge, UnblurredEdgeIsThePixelsBox) {
  const double angle = 5.0 * kDegree;
  const Image image = oracle::edge_picture({.angle = angle}, oracle::disc_profile(1e-6));
  const SlantedEdge edge = measured(image);
  const double expected = oracle::first_frequency(
      [&](double nu) { return oracle::disc_pixel_otf(nu, 0.0, angle); }, 0.5);
  EXPECT_NEAR(edge.mtf50, expected, 1e-3);
}

// The fixture's rows: another derivation of the MTF50 at 5 degrees. Tolerance: 5e-4 of the MTF
// over its slope at 50 %, which is 0.6 R and 1.3 px at least.
TEST(SlantedEdge, Mtf50AgreesWithTheFixture) {
  const nlohmann::json fixture = oracle::fixture("disc_blur");
  for (const auto& row : fixture.at("rows")) {
    const double radius = row.at("R_px").get<double>();
    const int size = std::max(128, static_cast<int>(8.0 * radius));
    const Image image = oracle::edge_picture({.width = size,
                                              .height = size,
                                              .through = {size / 2.0, size / 2.0},
                                              .angle = 5.0 * kDegree},
                                             oracle::disc_profile(radius));
    EXPECT_NEAR(measured(image).mtf50, row.at("mtf50_slanted_5deg").get<double>(), 4e-4)
        << radius << " px";
  }
}

// width_10_90 is the disc's alone; large discs hide the pixel, which adds its variance of 1/12 px^2
// along the normal to the disc's R^2/4: 1/6R^2 of the width at most, since the box is narrower
// than the disc's flat middle. The knots add less.
TEST(SlantedEdge, RiseOfLargeDiscsAgreesWithTheFixture) {
  int rows = 0;
  const nlohmann::json fixture = oracle::fixture("disc_blur");
  for (const auto& row : fixture.at("rows")) {
    const double radius = row.at("R_px").get<double>();
    if (radius < 3.0) continue;
    ++rows;
    const int size = std::max(128, static_cast<int>(8.0 * radius));
    const Image image = oracle::edge_picture({.width = size,
                                              .height = size,
                                              .through = {size / 2.0, size / 2.0},
                                              .angle = 7.0 * kDegree},
                                             oracle::disc_profile(radius));
    const double expected = row.at("width_10_90").get<double>();
    EXPECT_NEAR(measured(image).rise_10_90, expected, expected / (6.0 * radius * radius))
        << radius << " px";
  }
  EXPECT_GE(rows, 2);
}

// The slanted edge's radius through noise of 0.5 % and 2 %: the published bound of this
// measurement, root mean square 0.07 px for radii of 0.5 to 8 px and 0.1 px at 0.25 px.
TEST(SlantedEdge, RadiusFromMtf50KeepsItsBoundThroughNoise) {
  for (const double noise : {0.005, 0.02}) {
    for (const double radius : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0}) {
      double squares = 0.0;
      constexpr int kPictures = 12;
      for (unsigned seed = 1; seed <= kPictures; ++seed) {
        const double angle = (3.0 + 2.9 * seed) * kDegree;
        const Image image = oracle::edge_picture({.angle = angle, .noise = noise, .seed = seed},
                                                 oracle::disc_profile(radius));
        const double found = radius_of_mtf50(measured(image).mtf50, angle);
        squares += (found - radius) * (found - radius) / kPictures;
      }
      const double bound = radius < 0.5 ? 0.1 : 0.07;
      std::printf("radius from MTF50, %.1f %% noise, R %.2f px: rms error %.4f px\n", 100 * noise,
                  radius, std::sqrt(squares));
      EXPECT_LT(std::sqrt(squares), bound) << radius << " px, noise " << noise;
    }
  }
}

// Any of the eight ways an edge can run: the same sharpness, and the line where it was put.
TEST(SlantedEdge, PlaceAndDirectionAreFound) {
  constexpr double kRadius = 2.0;
  for (const double degrees : {5.0, 85.0, 95.0, 175.0, 185.0, 265.0, 275.0, 355.0, 30.0, 250.0}) {
    const double angle = degrees * kDegree;
    const oracle::EdgePicture picture{
        .width = 96, .height = 80, .through = {50.2, 39.1}, .angle = angle};
    const SlantedEdge edge = measured(oracle::edge_picture(picture, oracle::disc_profile(kRadius)));
    const Vec2 off = edge.point - picture.through;
    EXPECT_NEAR(edge.normal.x, std::cos(angle), 1e-5) << degrees;
    EXPECT_NEAR(edge.normal.y, std::sin(angle), 1e-5) << degrees;
    EXPECT_NEAR(off.x * edge.normal.x + off.y * edge.normal.y, 0.0, 1e-4) << degrees;
    EXPECT_LT(largest_mtf_error(edge, kRadius, angle, 1.0), 5e-4) << degrees;
  }
}

// The region's corner and the channel are honoured: the same edge inside a larger picture of
// three channels, at whole pixels, gives the same numbers.
TEST(SlantedEdge, RegionAndChannelSelectWhatIsMeasured) {
  const Image edge = oracle::edge_picture(
      {.width = 64, .height = 64, .through = {32.3, 31.6}, .angle = 6.0 * kDegree},
      oracle::disc_profile(1.5));
  Image large(100, 90, 3);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) large.at(x + 21, y + 13)[1] = *edge.at(x, y);
  }
  const SlantedEdge alone = measured(edge);
  const SlantedEdge inside = measured_slanted_edge(std::as_const(large).view(),
                                                   {.region = {21, 13, 64, 64}, .channel = 1});
  EXPECT_EQ(inside.mtf50, alone.mtf50);
  EXPECT_NEAR(inside.point.x, alone.point.x + 21, 1e-12);
  EXPECT_NEAR(inside.point.y, alone.point.y + 13, 1e-12);
}

// Contrast counted from known levels: an edge of 0.7 measured as part of 1.4 has half the MTF.
TEST(SlantedEdge, KnownLevelsScaleTheMtf) {
  const Image image = oracle::edge_picture({.angle = 5.0 * kDegree}, oracle::disc_profile(2.0));
  SlantedEdgeSpec spec{.region = {0, 0, 128, 128}, .levels = EdgeLevels{0.1, 0.8}};
  const SlantedEdge whole = measured_slanted_edge(image.view(), spec);
  EXPECT_NEAR(whole.mtf.at(0), 1.0, 1e-6);
  EXPECT_LT(largest_mtf_error(whole, 2.0, 5.0 * kDegree, 1.0), 5e-4);
  spec.levels = EdgeLevels{0.05, 0.85};
  EXPECT_NEAR(measured_slanted_edge(image.view(), spec).mtf.at(0), 0.7 / 0.8, 1e-6);
}

TEST(SlantedEdge, RefusesWhatIsNoEdge) {
  const SlantedEdgeSpec all{.region = {0, 0, 128, 128}};
  const auto picture = [](double degrees, double radius, double noise = 0.0) {
    return oracle::edge_picture({.angle = degrees * kDegree, .noise = noise},
                                oracle::disc_profile(radius));
  };
  const Image flat(128, 128, 1);
  EXPECT_NE(reason_of_refusal(flat, all).find("no edge"), std::string::npos);
  const Image grain = oracle::edge_picture({.noise = 0.3}, [](double) { return 0.5; });
  EXPECT_NE(reason_of_refusal(grain, all).find("no edge"), std::string::npos);
  EXPECT_NE(reason_of_refusal(picture(10.0, 1.0, 0.3), all).find("contrast"), std::string::npos);
  for (const double degrees : {0.0, 0.5, 44.5, 45.0, 90.0}) {
    EXPECT_NE(reason_of_refusal(picture(degrees, 1.0), all), "measured") << degrees;
  }
  EXPECT_NE(reason_of_refusal(picture(44.0, 1.0), all).find("2 and 43"), std::string::npos);
  // 16 rows at 2 degrees shift the edge by 0.56 px, less than the phases of a pixel.
  const SlantedEdgeSpec low{.region = {32, 56, 64, 16}};
  EXPECT_NE(reason_of_refusal(picture(2.0, 1.0), low), "measured");
  // A bar: two edges, both sides alike.
  const Image bar = oracle::edge_picture({.angle = 5.0 * kDegree}, [](double x) {
    return oracle::disc_profile(2.0)(x + 9.0) - oracle::disc_profile(2.0)(x - 9.0);
  });
  EXPECT_NE(reason_of_refusal(bar, all), "measured");
  // A blur of twice the region's width.
  EXPECT_NE(reason_of_refusal(picture(5.0, 128.0), all).find("too small"), std::string::npos);
}

TEST(SlantedEdge, RefusesRegionsAndValuesOutsideItsDomain) {
  Image image = oracle::edge_picture({.angle = 5.0 * kDegree}, oracle::disc_profile(1.0));
  for (const PixelRegion& region :
       {PixelRegion{-1, 0, 64, 64}, PixelRegion{65, 0, 64, 64}, PixelRegion{0, 65, 64, 64},
        PixelRegion{0, 0, 15, 64}, PixelRegion{0, 0, 64, 15}, PixelRegion{0, 0, 0, 0},
        PixelRegion{2147483647, 0, 64, 64}}) {
    EXPECT_NE(reason_of_refusal(image, {.region = region}).find("region"), std::string::npos);
  }
  EXPECT_NE(reason_of_refusal(image, {.region = {0, 0, 64, 64}, .channel = 1}).find("channel"),
            std::string::npos);
  *image.at(3, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(reason_of_refusal(image, {.region = {0, 0, 128, 128}}).find("finite"),
            std::string::npos);
  const LineSpread line{.first = 0.0, .step = 1.0, .density = {1.0}};
  EXPECT_THROW(frequency_of_contrast(line, 0.0), Error);
  EXPECT_THROW(frequency_of_contrast(line, 1.0), Error);
  EXPECT_EQ(frequency_of_contrast(line, 0.5), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace fstop
