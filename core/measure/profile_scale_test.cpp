#include "core/measure/profile_scale.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/diffraction.h"
#include "tests/references/blurred_edge.h"

namespace fstop {
namespace {

constexpr double kAngle = 5.0 * std::numbers::pi / 180.0;
constexpr double kRadius = 6.0;  // px

double disc_otf(double nu, double scale) {
  const double x = 2.0 * std::numbers::pi * nu * kRadius * scale;
  return x < 1e-9 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
}

SlantedEdgeSpec whole(const Image& image) {
  return {.region = {.x = 0, .y = 0, .width = image.width(), .height = image.height()}};
}

// Noiseless pictures in single precision; the parabola in the scale holds to 1e-5 within 3 %.
TEST(ProfileScale, FindsTheDiscOfAPictureMadeByQuadrature) {
  for (const double scale : {0.975, 0.99, 1.0, 1.01, 1.025}) {
    const Image image =
        oracle::edge_picture({.angle = kAngle}, oracle::disc_profile(kRadius * scale));
    const ProfileScale fit = fit_profile_scale(image.view(), whole(image), disc_otf);
    EXPECT_NEAR(fit.scale, scale, 3e-5);
    EXPECT_NEAR(fit.levels.dark, 0.1, 1e-5);
    EXPECT_NEAR(fit.levels.bright, 0.8, 1e-5);
    EXPECT_LT(fit.residual, 2e-5);
  }
}

// Both sides brighter across the edge, by 0.02 over the picture: no part of the blur.
TEST(ProfileScale, IsNotMisledByUnevenLight) {
  Image image = oracle::edge_picture({.angle = kAngle}, oracle::disc_profile(1.01 * kRadius));
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double across = x * std::cos(kAngle) + y * std::sin(kAngle);
      *image.at(x, y) += static_cast<float>(0.02 * across / image.width());
    }
  }
  const ProfileScale fit = fit_profile_scale(std::as_const(image).view(), whole(image), disc_otf);
  EXPECT_NEAR(fit.scale, 1.01, 3e-5);
}

// Far beyond the family the scale ends at its bound: red, not wrong by chance.
TEST(ProfileScale, StopsAtTheWidestScale) {
  const Image image = oracle::edge_picture({.angle = kAngle}, oracle::disc_profile(2.0 * kRadius));
  try {
    const ProfileScale fit = fit_profile_scale(image.view(), whole(image), disc_otf);
    EXPECT_NEAR(fit.scale, 1.0 + kWidestProfileScale, 1e-12);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::outside_domain);
  }
}

/// The edge spread of a round pupil in focus: the Airy pattern's lines by quadrature across it, and
/// their sum from the middle on. No transfer function is in it.
class AiryEdge {
 public:
  explicit AiryEdge(double airy_unit) : unit_(airy_unit) {
    double sum = 0.0;
    double before = line(0.0);
    values_.push_back(0.0);
    for (int i = 1; i < 6000; ++i) {
      const double here = line(i * kStep);
      const double middle = line((i - 0.5) * kStep);
      sum += kStep * (before + 4.0 * middle + here) / 6.0;  // Simpson
      before = here;
      values_.push_back(sum);
    }
  }
  double operator()(double x) const {
    const double at = std::min(std::abs(x) / kStep, static_cast<double>(values_.size()) - 2.0);
    const auto i = static_cast<std::size_t>(at);
    const double t = at - static_cast<double>(i);
    return 0.5 + std::copysign(values_[i] + t * (values_[i + 1] - values_[i]), x);
  }

 private:
  static constexpr double kStep = 0.02;  // px

  // Density of a line at x: the integral along it of pi/4/unit^2 (2 J1(v)/v)^2, v = pi r/unit.
  double line(double x) const {
    constexpr double kFine = 0.05;
    double sum = 0.0;
    for (double s = 0.5 * kFine; s < 8.0; s += kFine) {  // y = sinh s / 2: to 750 px
      const double y = 0.5 * std::sinh(s);
      const double v = std::numbers::pi * std::hypot(x, y) / unit_;
      sum += airy_intensity(v) * 0.5 * std::cosh(s) * kFine;
    }
    return 2.0 * sum * std::numbers::pi / 4.0 / (unit_ * unit_);
  }

  double unit_;  // lambda N in px
  std::vector<double> values_ = {};
};

// Tolerance: the line's table, quadrature in y with 0.05 steps, and its end at 750 px, 1e-4.
TEST(ProfileScale, FindsTheCutOffOfADiffractedEdge) {
  constexpr double kUnit = 3.0;  // px: cut-off at 1/3 cycles/px
  const auto otf = [](double nu, double scale) {
    const double t = nu * kUnit * scale;
    return t >= 1.0 ? 0.0 : 2.0 / std::numbers::pi * (std::acos(t) - t * std::sqrt(1.0 - t * t));
  };
  for (const double scale : {0.99, 1.0, 1.01}) {
    const AiryEdge edge(kUnit * scale);
    const Image image = oracle::edge_picture({.angle = kAngle}, [&](double x) { return edge(x); });
    const ProfileScale fit = fit_profile_scale(image.view(), whole(image), otf);
    EXPECT_NEAR(fit.scale, scale, 4e-4);
  }
}

// Squares of the fit's errors over their told standard errors: their mean over 24 seeds lies
// between 0.35 and 2.1 but for 1 in 1000 (chi-square); a standard error from few tiles may say
// more.
TEST(ProfileScale, TellsItsOwnNoise) {
  double squares = 0.0;
  constexpr int kSeeds = 24;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Image image = oracle::edge_picture({.width = 96,
                                              .height = 96,
                                              .through = {48.17, 47.71},
                                              .angle = kAngle,
                                              .noise = 0.01,
                                              .seed = seed},
                                             oracle::disc_profile(kRadius));
    const ProfileScale fit = fit_profile_scale(image.view(), whole(image), disc_otf);
    squares += std::pow((fit.scale - 1.0) / fit.standard_error, 2);
    EXPECT_LT(std::abs(fit.scale - 1.0), 4.0 * fit.standard_error);
  }
  EXPECT_GT(squares / kSeeds, 0.2);
  EXPECT_LT(squares / kSeeds, 2.1);
}

}  // namespace
}  // namespace fstop
