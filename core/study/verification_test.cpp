// Verification of pictures that no renderer made: edges from closed forms, right and wrong.
#include "core/study/verification.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/study/verification_chart.h"
#include "core/study/verification_report.h"
#include "core/study/verification_self_test.h"
#include "tests/references/blurred_edge.h"

namespace fstop {
namespace {

constexpr Length kObject = Length::si(5.0);

/// Photographs edges at kObject by the thin lens equation, as the shot's camera has it, and walls
/// by the f-number's square; knows nothing of what is expected.
struct ClosedFormCamera {
  double noise = 0.0;
  unsigned seed = 1;

  Image operator()(const ChartShot& chart) const {
    const SimulationSpec& shot = chart.shot;
    const auto& lens = std::get<LensSpec>(shot.camera.optics);
    const double f = lens.lens.focal_length.si();
    const double v = 1.0 / (1.0 / f - 1.0 / lens.focus_distance.si());
    if (shot.camera.exposure) {
      const double n = lens.lens.f_number * v / f;
      return grey(shot, [&](int, int) {
        return 8000.0 * shot.camera.shutter_seconds * shot.camera.exposure->iso / 100.0 / (n * n);
      });
    }
    const double pitch = shot.camera.sensor_width.si() / shot.width;
    const double radius = 0.5 * f / lens.lens.f_number * v *
                          std::abs(1.0 / lens.focus_distance.si() - 1.0 / kObject.si()) / pitch;
    const Image edge = oracle::edge_picture({.width = shot.width,
                                             .height = shot.height,
                                             .through = {0.5 * shot.width, 0.5 * shot.height},
                                             .angle = kChartSlant,
                                             .dark = 0.0,
                                             .bright = 1.0,
                                             .noise = noise,
                                             .seed = seed},
                                            oracle::disc_profile(radius));
    return grey(shot, [&](int x, int y) { return double{edge.at(x, y)[0]}; });
  }

 private:
  template <typename Value>
  static Image grey(const SimulationSpec& shot, const Value& value) {
    Image image(shot.width, shot.height, 3);
    for (int y = 0; y < shot.height; ++y) {
      for (int x = 0; x < shot.width; ++x) {
        for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(value(x, y));
      }
    }
    return image;
  }
};

VerificationCheck blur_check() {
  VerificationCheck check{.name = "blur", .kind = VerificationKind::blur, .camera_name = "a"};
  check.camera.optics =
      LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 2.0}, .focus_distance = 2.0_m};
  check.f_numbers = {1.4, 2.0, 2.8, 4.0};
  check.object_distances = {kObject};
  return check;
}

TEST(Verification, PicturesOfTheRightCameraAreGreen) {
  const VerificationOutcome outcome = verified(blur_check(), ClosedFormCamera{.noise = 0.001});
  EXPECT_EQ(outcome.failure, "");
  EXPECT_TRUE(outcome.holds()) << verification_text(outcome);
  EXPECT_EQ(outcome.results.size(), 5U);  // four discs and their common factor
  EXPECT_EQ(outcome.pictures, 4);
  EXPECT_TRUE(outcome.results.back().is_fit);
  EXPECT_LE(outcome.results.back().tolerance(), 0.004);
}

TEST(Verification, TransferOutOfFocusIsThatOfTheDisc) {
  VerificationCheck check = blur_check();
  check.kind = VerificationKind::defocus_mtf;
  check.f_numbers.clear();
  const VerificationOutcome outcome = verified(check, ClosedFormCamera{.noise = 0.001});
  EXPECT_TRUE(outcome.holds()) << verification_text(outcome);
  EXPECT_EQ(outcome.results.size(), 2U);
}

TEST(Verification, BrightnessFollowsTheFNumbersSquare) {
  VerificationCheck check = blur_check();
  check.kind = VerificationKind::brightness;
  check.camera.exposure = IsoExposure{.iso = 100.0};
  check.camera.shutter_seconds = 0.01;
  EXPECT_TRUE(verified(check, ClosedFormCamera{}).holds());
  const VerificationOutcome wrong = verified(check, [&](const ChartShot& shot) {
    return ClosedFormCamera{}(with_planted(shot, PlantedError::aperture, 1.01));
  });
  EXPECT_EQ(std::ranges::count_if(wrong.results, [](const auto& r) { return !r.holds(); }), 4);
}

TEST(Verification, OnePercentInTheRequestIsCaught) {
  const std::vector<VerificationCheck> checks = {blur_check()};
  double last = 0.0;
  const std::vector<PlantedTrial> trials = planted_trials(
      checks, 0.01, ClosedFormCamera{.noise = 0.001}, [&](double share) { last = share; });
  ASSERT_EQ(trials.size(), 4U);  // no check of rays shows a wavelength
  for (const PlantedTrial& trial : trials) EXPECT_TRUE(trial.is_caught()) << trial_text(trial);
  EXPECT_EQ(last, 1.0);
  // Without the error the same finds nothing: it is the error that is caught.
  for (const PlantedTrial& trial :
       planted_trials(checks, 0.0, ClosedFormCamera{.noise = 0.001}, {})) {
    EXPECT_FALSE(trial.is_caught()) << trial_text(trial);
  }
}

// Noise widens the tolerance, so it must not turn a wrong camera green.
TEST(Verification, NoiseIsNoExcuse) {
  const VerificationOutcome outcome = verified(blur_check(), ClosedFormCamera{.noise = 0.05});
  EXPECT_FALSE(outcome.holds());
  EXPECT_NE(verification_text(outcome).find("too noisy to tell"), std::string::npos);
}

TEST(Verification, NumbersOfTheSuitesOwnReplaceClosedForms) {
  VerificationCheck check = blur_check();
  check.f_numbers = {2.0};
  const double right = verified(check, ClosedFormCamera{}).results[0].expected;
  check.expected = {1.03 * right};
  EXPECT_FALSE(verified(check, ClosedFormCamera{}).holds());
  check.further_tolerance = 0.05;
  EXPECT_TRUE(verified(check, ClosedFormCamera{}).holds());
  check.expected = {right, right, right};
  const VerificationOutcome too_many = verified(check, ClosedFormCamera{});
  EXPECT_NE(too_many.failure.find("expected has 3 values"), std::string::npos) << too_many.failure;
}

TEST(Verification, RefusalsAreRedAndLostServersEndIt) {
  const auto refusing = [](ErrorCode code) {
    return [code](const ChartShot&) -> Image { throw Error(code, "told <so>"); };
  };
  const VerificationOutcome refused = verified(blur_check(), refusing(ErrorCode::unsupported));
  EXPECT_FALSE(refused.holds());
  EXPECT_EQ(refused.failure, "told <so>");
  EXPECT_THROW(verified(blur_check(), refusing(ErrorCode::io_failure)), Error);
  const VerificationOutcome wrong_size =
      verified(blur_check(), [](const ChartShot&) { return Image(3, 3, 3); });
  EXPECT_NE(wrong_size.failure.find("another size"), std::string::npos);
}

TEST(VerificationReport, HoldsEveryResultAndNeedsNoOtherHost) {
  const std::vector<VerificationOutcome> outcomes = {
      verified(blur_check(), ClosedFormCamera{.noise = 0.001}),
      verified(blur_check(), [](const ChartShot&) -> Image {
        throw Error(ErrorCode::unsupported, "a <b> & \"c\"");
      })};
  const std::vector<PlantedTrial> trials = planted_trials(
      std::vector<VerificationCheck>{blur_check()}, 0.01, ClosedFormCamera{.noise = 0.001}, {});
  const VerificationHeading heading{.suite = "suite", .target = "a server", .engine = "fstop/1"};
  const std::string html = verification_html(heading, outcomes, trials);
  for (const VerificationResult& result : outcomes[0].results) {
    EXPECT_NE(html.find(result.name), std::string::npos) << result.name;
  }
  EXPECT_NE(html.find("data:image/png;base64,iVBOR"), std::string::npos);
  EXPECT_NE(html.find("data:image/svg+xml;base64,"), std::string::npos);
  EXPECT_NE(html.find("a &lt;b&gt; &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_EQ(html.find("http:"), std::string::npos);
  EXPECT_EQ(html.find("https:"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  const std::string junit = verification_junit(heading, outcomes, trials);
  EXPECT_NE(junit.find("<testsuite name=\"blur\" tests=\"5\" failures=\"0\" errors=\"0\">"),
            std::string::npos)
      << junit;
  EXPECT_NE(junit.find("<testsuite name=\"blur\" tests=\"1\" failures=\"0\" errors=\"1\">"),
            std::string::npos);
  EXPECT_NE(junit.find("<error message=\"a &lt;b&gt; &amp; &quot;c&quot;\"/>"), std::string::npos);
  EXPECT_NE(junit.find("<testsuite name=\"planted errors\" tests=\"4\" failures=\"0\""),
            std::string::npos);
}

TEST(VerificationReport, PlotsHaveAMarkForEveryMeasurement) {
  const std::string svg = verification_plot({.title = "t",
                                             .x_label = "x",
                                             .y_label = "y",
                                             .x = {1.0, 2.0, 3.0},
                                             .measured = {1.0, 4.0, 9.0},
                                             .expected = {1.0, 4.0, 9.1}});
  std::size_t marks = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos;
       at = svg.find("<circle", at + 1)) {
    ++marks;
  }
  EXPECT_EQ(marks, 3U);
  EXPECT_NE(svg.find("<polyline"), std::string::npos);
  EXPECT_EQ(verification_plot({}).find("<circle"), std::string::npos);
}

}  // namespace
}  // namespace fstop
