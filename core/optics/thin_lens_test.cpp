#include "core/optics/thin_lens.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Length kNan = Length::si(std::numeric_limits<double>::quiet_NaN());
const ThinLens kFifty{.focal_length = 50.0_mm, .f_number = 1.8};

// The fixture's own statement: 1e-12 relative.
void expect_equal(double actual, const nlohmann::json& row, const char* column) {
  const double expected = oracle::number(row.at(column));
  EXPECT_LE(oracle::relative_difference(actual, expected), 1e-12)
      << column << ": " << actual << " instead of " << expected << "\n"
      << row.dump();
}
void expect_equal(Length actual, const nlohmann::json& row, const char* column) {
  expect_equal(actual.si() * 1e3, row, column);
}

ThinLens lens_of(const nlohmann::json& row) {
  return {.focal_length = oracle::millimetres(row.at("f")), .f_number = row.at("N")};
}

TEST(ThinLens, AgreesWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("thinlens");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const ThinLens lens = lens_of(row);
    const Length f = lens.focal_length;
    const Length focus = oracle::millimetres(row.at("focus_distance"));
    const Length object = oracle::millimetres(row.at("object_distance"));
    const Length pitch = oracle::millimetres(row.at("pixel_pitch"));
    const Length width = oracle::millimetres(row.at("sensor_width"));
    const Length v = image_distance(f, focus);
    const Length coc = signed_circle_of_confusion(lens, focus, object);
    expect_equal(v, row, "image_distance_of_focus");
    expect_equal(image_distance(f, object), row, "image_distance_of_object");
    expect_equal(magnification(f, focus), row, "magnification_at_focus");
    expect_equal(aperture_diameter(lens), row, "aperture_diameter");
    expect_equal(coc, row, "coc_signed");
    expect_equal(coc / pitch, row, "coc_px");
    expect_equal(working_f_number(lens, focus), row, "working_f_number");
    expect_equal(view_angle(width, v), row, "fov_thin_rad");
    expect_equal(view_angle(width, f), row, "fov_f_only_rad");
    EXPECT_EQ(circle_of_confusion(lens, focus, object), abs(coc));
  }
}

// near, far, hyperfocal and the approximations are read in depth_of_field_test, the illuminances
// in exposure_test; a column that nobody reads must show.
TEST(ThinLens, FixtureHasNoColumnThatNoTestReads) {
  const std::set<std::string> read = {"f",
                                      "N",
                                      "coc_limit",
                                      "focus_distance",
                                      "object_distance",
                                      "pixel_pitch",
                                      "sensor_width",
                                      "image_distance_of_focus",
                                      "image_distance_of_object",
                                      "magnification_at_focus",
                                      "aperture_diameter",
                                      "coc_signed",
                                      "coc_px",
                                      "working_f_number",
                                      "fov_thin_rad",
                                      "fov_f_only_rad",
                                      "near",
                                      "far",
                                      "hyperfocal",
                                      "approximations",
                                      "illuminance_on_axis_flat_pupil",
                                      "illuminance_on_axis_small_aperture",
                                      "illuminance_corner_flat_pupil"};
  const nlohmann::json table = oracle::fixture("thinlens");
  for (const nlohmann::json& row : table.at("rows")) {
    for (const auto& member : row.items()) EXPECT_TRUE(read.contains(member.key())) << member.key();
    EXPECT_EQ(row.size(), read.size());
  }
}

TEST(ImageDistance, AnswersAtTheEdges) {
  EXPECT_EQ(image_distance(50.0_mm, kInfinitelyFar), 50.0_mm);
  EXPECT_EQ(image_distance(50.0_mm, 50.0_mm), kInfinitelyFar);
  // Twice the focal length images at twice the focal length; half of it 50 mm before the lens.
  EXPECT_NEAR(image_distance(50.0_mm, 100.0_mm).si(), 0.1, 1e-16);
  EXPECT_NEAR(image_distance(50.0_mm, 25.0_mm).si(), -0.05, 1e-16);
}

// Newton's form (u - f)(v - f) = f^2 is another derivation. Where u is within a part in 10^9 of f,
// v - f still has the digits of u - f, which is exact: six roundings of 2^-53.
TEST(ImageDistance, ObeysNewtonsFormNearTheFocus) {
  const Length f = 50.0_mm;
  for (const double step : {1e-9, -1e-9, 1e-6, -1e-6, 0.1, 1.0, 100.0}) {
    const Length u = f * (1.0 + step);
    const Length v = image_distance(f, u);
    const double newton = (u - f) / f * ((v - f) / f);
    // v - f cancels when u is far from f: its digits are those of v times v/(v - f) = u/f.
    EXPECT_NEAR(newton, 1.0, 7e-16 * (2.0 + std::abs(u / f))) << "u = f (1 + " << step << ")";
  }
}

TEST(ImageDistance, RefusesWhatIsNotPositive) {
  for (const Length bad : {Length{}, -(1.0_mm), kNan}) {
    EXPECT_THROW(image_distance(bad, 1.0_m), Error);
    EXPECT_THROW(image_distance(50.0_mm, bad), Error);
  }
}

// A callable's refusal; `internal` stands for "answered".
template <typename Call>
ErrorCode refusal(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(ThinLens, FocusAtOrInsideTheFocalLengthIsRefused) {
  const Length f = kFifty.focal_length;
  for (const Length s : {f, f * 0.5, Length{}, -f, kNan, Length::si(std::nextafter(f.si(), 0.0))}) {
    const auto code = ErrorCode::outside_domain;
    EXPECT_EQ(refusal([&] { magnification(f, s); }), code) << s.si();
    EXPECT_EQ(refusal([&] { working_f_number(kFifty, s); }), code) << s.si();
    EXPECT_EQ(refusal([&] { signed_circle_of_confusion(kFifty, s, 1.0_m); }), code) << s.si();
    EXPECT_EQ(refusal([&] { signed_circle_of_confusion(kFifty, s, 1.0_m, f); }), code) << s.si();
    EXPECT_EQ(refusal([&] { circle_of_confusion(kFifty, s, 1.0_m); }), code) << s.si();
  }
}

TEST(ThinLens, FocusJustBeyondTheFocalLengthIsAnswered) {
  const Length f = kFifty.focal_length;
  const Length s = Length::si(std::nextafter(f.si(), 1.0));
  EXPECT_LT(magnification(f, s), -1e14);
  EXPECT_GT(working_f_number(kFifty, s), 1e14);
  EXPECT_TRUE(is_finite(signed_circle_of_confusion(kFifty, s, 1.0_m)));
}

TEST(ThinLens, BadLensIsRefused) {
  const double nan = kNan.si();
  for (const ThinLens lens :
       {ThinLens{}, ThinLens{0.0_mm, 2.0}, ThinLens{-(50.0_mm), 2.0}, ThinLens{kNan, 2.0},
        ThinLens{50.0_mm, 0.0}, ThinLens{50.0_mm, -2.0}, ThinLens{50.0_mm, nan}}) {
    const auto code = ErrorCode::outside_domain;
    EXPECT_EQ(refusal([&] { aperture_diameter(lens); }), code);
    EXPECT_EQ(refusal([&] { working_f_number(lens, 1.0_m); }), code);
    EXPECT_EQ(refusal([&] { signed_circle_of_confusion(lens, 1.0_m, 2.0_m); }), code);
    EXPECT_EQ(refusal([&] { circle_of_confusion(lens, 1.0_m, 2.0_m); }), code);
  }
}

TEST(CircleOfConfusion, BadObjectDistanceIsRefused) {
  for (const Length d : {Length{}, -(1.0_m), kNan}) {
    EXPECT_THROW(signed_circle_of_confusion(kFifty, 1.0_m, d), Error);
    EXPECT_THROW(signed_circle_of_confusion(kFifty, kInfinitelyFar, d), Error);
  }
}

TEST(CircleOfConfusion, InfinityIsAnswered) {
  const Length f = kFifty.focal_length;
  const Length A = f / kFifty.f_number;
  EXPECT_EQ(signed_circle_of_confusion(kFifty, kInfinitelyFar, kInfinitelyFar), Length{});
  // Focused at infinity v = f: c = -A f/d. Seen from infinity: c = A f/(s - f).
  EXPECT_NEAR(signed_circle_of_confusion(kFifty, kInfinitelyFar, 5.0_m).si(),
              -(A * (f / 5.0_m)).si(), 1e-18);
  EXPECT_NEAR(signed_circle_of_confusion(kFifty, 2.0_m, kInfinitelyFar).si(),
              (A * (f / (2.0_m - f))).si(), 1e-18);
}

TEST(CircleOfConfusion, SignTellsTheSideOfTheFocusedPlane) {
  EXPECT_LT(signed_circle_of_confusion(kFifty, 2.0_m, 1.9_m), Length{});
  EXPECT_GT(signed_circle_of_confusion(kFifty, 2.0_m, 2.1_m), Length{});
  EXPECT_EQ(signed_circle_of_confusion(kFifty, 2.0_m, 2.0_m), Length{});
}

// At d = f the light leaves the lens parallel: the disc is the pupil itself, wherever the sensor.
TEST(CircleOfConfusion, ObjectAtTheFocalPointShowsThePupil) {
  const Length f = kFifty.focal_length;
  for (const Length s : {0.06_m, 1.0_m, 1000.0_m, kInfinitelyFar}) {
    const double ratio = signed_circle_of_confusion(kFifty, s, f) / aperture_diameter(kFifty);
    EXPECT_NEAR(ratio, -1.0, 1e-13) << s.si();
  }
}

// c = (f^2/N) (d - s)/(d (s - f)) is other algebra than the code's, in 64-bit mantissas; both
// differences of close doubles are exact. The code's v has the conditioning of s - f, here 1:
// eight roundings of 2^-53 = 9e-16, well inside 1e-13.
TEST(CircleOfConfusion, KeepsAllDigitsNearFocus) {
  const auto f = static_cast<long double>(kFifty.focal_length.si());
  const auto N = static_cast<long double>(kFifty.f_number);
  for (const Length s : {0.3_m, 2.0_m, 97.3_m}) {
    for (const double step : {1e-6, 1e-8, 1e-10, 1e-12}) {
      for (const double side : {-1.0, 1.0}) {
        const Length d = s * (1.0 + side * step);
        const auto sl = static_cast<long double>(s.si());
        const auto dl = static_cast<long double>(d.si());
        const long double expected = f * f / N * (dl - sl) / (dl * (sl - f));
        const long double actual = signed_circle_of_confusion(kFifty, s, d).si();
        EXPECT_LE(std::abs((actual - expected) / expected), 1e-13L)
            << "s " << s.si() << " m, d = s (1 + " << side * step << ")";
      }
    }
  }
}

TEST(CircleOfConfusion, FollowsTheSensorAtAGivenDistance) {
  const Length v = image_distance(kFifty.focal_length, 2.0_m);
  const Length breathing = signed_circle_of_confusion(kFifty, 2.0_m, 3.0_m);
  EXPECT_EQ(signed_circle_of_confusion(kFifty, 2.0_m, 3.0_m, v), breathing);
  const Length fixed = signed_circle_of_confusion(kFifty, 2.0_m, 3.0_m, kFifty.focal_length);
  // Smaller by f/v = (s - f)/s.
  EXPECT_NEAR(fixed / breathing, 1.95 / 2.0, 1e-15);
}

TEST(VergenceDifference, IsExactAndAntisymmetric) {
  EXPECT_EQ(vergence_difference(2.0_m, 4.0_m).si(), 0.25);
  EXPECT_EQ(vergence_difference(4.0_m, 2.0_m).si(), -0.25);
  EXPECT_EQ(vergence_difference(2.0_m, kInfinitelyFar).si(), 0.5);
  EXPECT_EQ(vergence_difference(kInfinitelyFar, 2.0_m).si(), -0.5);
  EXPECT_EQ(vergence_difference(kInfinitelyFar, kInfinitelyFar).si(), 0.0);
  EXPECT_EQ(vergence_difference(3.0_m, 3.0_m).si(), 0.0);
}

TEST(ViewAngle, IsTwiceTheArcTangent) {
  EXPECT_NEAR(view_angle(36.0_mm, 18.0_mm), std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(view_angle(36.0_mm, kInfinitelyFar), 0.0);
}

struct Shot {
  ThinLens lens = {};
  Length focus = {};
  Length object = {};
};

// Over all a request may ask for and the special values in between.
class RandomShots {
 public:
  Shot next() {
    const Length f = Length::si(log_uniform(1e-3, 2.0));
    Shot shot{.lens = {.focal_length = f, .f_number = log_uniform(0.5, 256.0)},
              .focus = f * (1.0 + log_uniform(1e-12, 1e6)),
              .object = Length::si(log_uniform(1e-4, 1e6))};
    if (one_in(10)) shot.focus = kInfinitelyFar;
    if (one_in(10)) shot.object = kInfinitelyFar;
    if (one_in(10)) shot.object = f;
    if (one_in(10)) shot.object = shot.focus;
    return shot;
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double log_uniform(double low, double high) { return low * std::pow(high / low, uniform()); }
  bool one_in(int n) { return uniform() * n < 1.0; }

  std::mt19937_64 random_{20240601};
};

TEST(ThinLens, NeverAnswersNotANumber) {
  RandomShots shots;
  for (int i = 0; i < 100'000; ++i) {
    const auto [lens, s, d] = shots.next();
    const Length f = lens.focal_length;
    const double sum[] = {image_distance(f, s).si(),
                          image_distance(f, d).si(),
                          magnification(f, s),
                          aperture_diameter(lens).si(),
                          working_f_number(lens, s),
                          signed_circle_of_confusion(lens, s, d).si(),
                          signed_circle_of_confusion(lens, s, d, f).si(),
                          circle_of_confusion(lens, s, d).si(),
                          vergence_difference(s, d).si(),
                          view_angle(36.0_mm, image_distance(f, s))};
    for (const double value : sum) {
      ASSERT_FALSE(std::isnan(value))
          << "f " << f.si() << " N " << lens.f_number << " s " << s.si() << " d " << d.si();
    }
    ASSERT_LE(magnification(f, s), 0.0);
    ASSERT_GE(working_f_number(lens, s), lens.f_number);
    ASSERT_GE(circle_of_confusion(lens, s, d), Length{});
  }
}

// Optics has no length of its own: everything twice as large is twice as large, to the last bit,
// because a factor 2^k rounds nothing.
TEST(ThinLens, ScalesWithAllItsLengths) {
  RandomShots shots;
  for (int i = 0; i < 10'000; ++i) {
    const auto [lens, s, d] = shots.next();
    for (const double scale : {0x1p-7, 0x1p5}) {
      const ThinLens large{.focal_length = lens.focal_length * scale, .f_number = lens.f_number};
      ASSERT_EQ(image_distance(large.focal_length, d * scale),
                image_distance(lens.focal_length, d) * scale);
      ASSERT_EQ(signed_circle_of_confusion(large, s * scale, d * scale),
                signed_circle_of_confusion(lens, s, d) * scale);
      ASSERT_EQ(working_f_number(large, s * scale), working_f_number(lens, s));
    }
  }
}

// v = s |m| and N_w = N v/f are other derivations of what the code takes from f/(s - f).
TEST(ThinLens, MagnificationAndWorkingNumberFollowTheImageDistance) {
  for (const Length s : {0.06_m, 0.1_m, 0.5_m, 2.0_m, 300.0_m}) {
    const Length v = image_distance(kFifty.focal_length, s);
    EXPECT_NEAR(magnification(kFifty.focal_length, s) / (v / s), -1.0, 1e-14) << s.si();
    const double working = kFifty.f_number * (v / kFifty.focal_length);
    EXPECT_NEAR(working_f_number(kFifty, s) / working, 1.0, 1e-14) << s.si();
  }
  EXPECT_EQ(magnification(kFifty.focal_length, kInfinitelyFar), 0.0);
  EXPECT_EQ(working_f_number(kFifty, kInfinitelyFar), kFifty.f_number);
  EXPECT_LT(working_f_number(kFifty, 1.0_m), kInfinity);
}

}  // namespace
}  // namespace fstop
