#include "core/optics/transfer.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/quadrature.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

// The fixture's own statement: 1e-12 absolute.
TEST(Transfer, AgreesWithEveryDefocusedLensOfTheFixture) {
  const nlohmann::json table = oracle::fixture("defocused_lens");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    // W20 is the exact number; U is printed with 15 digits.
    const double U = 4.0 * std::numbers::pi * oracle::number(row.at("W20_waves"));
    const DefocusOtf otf(U);
    for (const nlohmann::json& point : row.at("otf")) {
      const double s = point.at("s");
      EXPECT_NEAR(otf(s), oracle::number(point.at("otf")), 1e-12) << point.dump() << U;
      EXPECT_NEAR(model_otf(OtfModel::disc, s, U), oracle::number(point.at("disc")), 1e-12);
      EXPECT_NEAR(model_otf(OtfModel::disc_times_airy, s, U),
                  oracle::number(point.at("disc_x_airy")), 1e-12);
      EXPECT_NEAR(model_otf(OtfModel::stretched_disc, s, U), oracle::number(point.at("stretched")),
                  1e-12);
      EXPECT_EQ(point.size(), 6U);
    }
  }
}

TEST(Transfer, AgreesWithEveryPinholeOfTheFixture) {
  const nlohmann::json table = oracle::fixture("pinhole_psf");
  for (const nlohmann::json& row : table.at("rows")) {
    const DefocusOtf otf(oracle::number(row.at("U")));
    for (const nlohmann::json& point : row.at("mtf")) {
      EXPECT_NEAR(otf(point.at("s")), oracle::number(point.at("otf")), 1e-11) << point.dump();
    }
  }
}

TEST(Transfer, MtfAgreesWithTheAiryFixture) {
  const nlohmann::json table = oracle::fixture("airy");
  for (const nlohmann::json& row : table.at("rows")) {
    EXPECT_NEAR(diffraction_mtf(row.at("s")), oracle::number(row.at("mtf")), 1e-12);
    EXPECT_NEAR(DefocusOtf(0.0)(row.at("s")), oracle::number(row.at("mtf")), 1e-12);
  }
}

// The overlap integral of the two shifted discs itself, over both of its dimensions: rows of the
// lens-shaped overlap, each the integral of a plane wave in closed form.
double overlap_otf(double s, double U) {
  const double height = std::sqrt(1.0 - 0.25 * s * s);
  const int panels = 40 + static_cast<int>(U);
  const auto row = [&](double angle) {  // y = height sin(angle): the overlap's corner is smooth
    const double y = height * std::sin(angle);
    const double half_width = std::sqrt(std::max(0.0, 1.0 - y * y)) - 0.5 * s;
    const double k = U * s;
    const double width =
        k * half_width < 1e-9 ? 2.0 * half_width : 2.0 * std::sin(k * half_width) / k;
    return width * height * std::cos(angle);
  };
  double sum = 0.0;
  for (int i = 0; i < panels; ++i) {
    sum += gauss16(0.5 * std::numbers::pi * i / panels, 0.5 * std::numbers::pi * (i + 1) / panels,
                   row);
  }
  return 2.0 * sum / std::numbers::pi;
}

TEST(Transfer, HopkinsIntegralIsTheOverlapOfTwoPupils) {
  for (const double U : {0.0, 0.7, 6.28, 40.0, 251.0, 1000.0}) {
    const DefocusOtf otf(U);
    for (const double s : {0.001, 0.05, 0.31, 0.77, 1.0, 1.5, 1.93, 1.9999}) {
      EXPECT_NEAR(otf(s), overlap_otf(s, U), 1e-12) << "s " << s << ", U " << U;
      EXPECT_EQ(otf(-s), otf(s));
      EXPECT_EQ(DefocusOtf(-U)(s), otf(s));
    }
    EXPECT_NEAR(otf(0.0), 1.0, 1e-13);
    for (const double s : {2.0, 2.5, -7.0, 1e300}) EXPECT_EQ(otf(s), 0.0);
  }
}

// Contrast reversal: at W20 = 2 waves the first sign change of the disc model lies near
// U s (1 - s/2) = 3.83; the OTF must be negative beyond it.
TEST(Transfer, KeepsTheSignOfReversedContrast) {
  const double U = 8.0 * std::numbers::pi;
  const DefocusOtf otf(U);
  EXPECT_GT(otf(0.12), 0.0);
  EXPECT_LT(otf(0.22), -0.05);
}

// The bounds that charts and plans quote, against the exact OTF on a grid finer than any feature.
TEST(Transfer, ModelErrorsStayBelowTheirLaws) {
  for (double waves = 0.01; waves <= 100.0; waves *= 1.17) {
    const double U = 4.0 * std::numbers::pi * waves;
    const DefocusOtf otf(U);
    const int count = 300 + static_cast<int>(3.0 * U);
    for (const OtfModel model :
         {OtfModel::airy, OtfModel::disc, OtfModel::disc_times_airy, OtfModel::stretched_disc}) {
      double worst = 0.0;
      for (int i = 0; i <= count; ++i) {
        const double s = 2.0 * i / count;
        worst = std::max(worst, std::abs(model_otf(model, s, U) - otf(s)));
      }
      const double law = model_otf_error(model, U);
      EXPECT_LE(worst, law) << "model " << static_cast<int>(model) << ", W20 " << waves;
      // Not so wide as to say nothing; the disc's law is loosest where it crosses 1.
      EXPECT_GE(worst, law / 3.0) << "model " << static_cast<int>(model) << ", W20 " << waves;
    }
  }
}

TEST(Transfer, RefusesDefocusBeyondItsDomain) {
  EXPECT_THROW(DefocusOtf(1.1e4), Error);
  EXPECT_THROW(DefocusOtf(std::numeric_limits<double>::quiet_NaN()), Error);
}

}  // namespace
}  // namespace fstop
