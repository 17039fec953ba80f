// Checks of rays: blur discs, depth of field, brightness, breathing.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/measure/disc_edge.h"
#include "core/study/expected_optics.h"
#include "core/study/verification_chart.h"
#include "core/study/verification_checks.h"

namespace fstop {
namespace {

constexpr int kGreen = 1;
constexpr int kEdgeSide = 112;      // px
constexpr double kDiscWide = 16.0;  // px
constexpr int kBlurSamples = 1024;
// Pixels of a block of 4 x 4 share the points of the pupil: at worst their errors are one.
constexpr double kBlockFactor = 4.0;
constexpr double kLargestSingle = 0.01;

// Sum over a region's pixels of (d value/d radius)^2, contrast 1, the edge `length` px long.
double radius_sensitivity(double radius, double length) {
  constexpr double kStep = 0.25;  // px
  double sum = 0.0;
  for (double x = -radius - 2.0; x <= radius + 2.0; x += kStep) {
    const double slope = (disc_pixel_edge(x, 1.001 * radius, kChartSlant) -
                          disc_pixel_edge(x, 0.999 * radius, kChartSlant)) /
                         (0.002 * radius);
    sum += slope * slope * kStep;
  }
  return sum * length;
}

double millimetres(Length length) { return length.si() * 1e3; }

// Where one list alone has several entries, that is what a curve is drawn over.
struct CurveAxis {
  std::string label = "expected blur diameter (mm)";
  int list = -1;  // 0 focus, 1 f-number, 2 object
};
CurveAxis curve_axis(std::size_t focuses, std::size_t f_numbers, std::size_t objects) {
  if (f_numbers == 1 && objects == 1) return {"focus distance (m)", 0};
  if (focuses == 1 && objects == 1) return {"f-number", 1};
  if (focuses == 1 && f_numbers == 1) return {"object distance (m)", 2};
  return {};
}

}  // namespace

MeasuredDisc measured_disc(VerificationRun& run, const VerificationCheck& check,
                           Length object_distance, int side, double wide) {
  const Length nominal = expected_blur_diameter(check.camera, object_distance);
  const Length pitch = std::max(nominal / wide, smallest_pitch(side));
  require_blurred(nominal, pitch);
  SimulationSpec shot = chart_shot(check, pitch, side, side);
  if (!shot.quality.samples) shot.quality.samples = kBlurSamples;
  const Image image = run.picture(shot, edge_chart(shot, object_distance));
  const DiscEdge disc = fit_disc_radius(
      image.view(), {.region = {.x = 0, .y = 0, .width = side, .height = side}, .channel = kGreen});
  // The noise lies where the edge is blurred, the residual is told of the whole region.
  const double where_noisy = std::sqrt(std::max(1.0, side / (2.0 * disc.radius + 1.0)));
  const double contrast = disc.levels.bright - disc.levels.dark;
  const double error = kBlockFactor * disc.residual * where_noisy /
                       (contrast * std::sqrt(radius_sensitivity(disc.radius, side)));
  return {.diameter = 2.0 * disc.radius * pitch,
          // Single precision leaves 1e-6 of the radius where a picture has no noise at all.
          .standard_error = 2.0 * std::max(error, 1e-6 * disc.radius) * pitch};
}

void check_blur(VerificationRun& run) {
  const std::vector<Length> focuses = focus_distances_of(run.check());
  const std::vector<double> f_numbers = f_numbers_of(run.check());
  const std::vector<Length> objects = object_distances_of(run.check());
  const CurveAxis axis = curve_axis(focuses.size(), f_numbers.size(), objects.size());
  VerificationCurve curve{.title = "Blur diameter", .x_label = axis.label, .y_label = "mm"};
  for (const Length focus : focuses) {
    for (const double f_number : f_numbers) {
      for (const Length object : objects) {
        const VerificationCheck one = with_f_number(with_focus(run.check(), focus), f_number);
        const MeasuredDisc disc = measured_disc(run, one, object, kEdgeSide, kDiscWide);
        const double nominal = millimetres(expected_blur_diameter(one.camera, object));
        const double measured = millimetres(disc.diameter);
        const double error = millimetres(disc.standard_error);
        const double expected =
            run.add({.name = "blur diameter, focus " + distance_text(focus) + ", " +
                             f_number_text(f_number) + ", object " + distance_text(object),
                     .unit = "mm",
                     .measured = measured,
                     .expected = nominal,
                     .shares = {{"sampling noise", kStandardErrors * error}},
                     .largest_tolerance = kLargestSingle * nominal});
        run.remember(measured, expected, error);
        const double x[] = {focus.si(), f_number, object.si(), expected};
        curve.x.push_back(x[axis.list < 0 ? 3 : axis.list]);
        curve.measured.push_back(measured);
        curve.expected.push_back(expected);
      }
    }
  }
  run.add_scale("all blur diameters, one factor fitted");
  run.add(std::move(curve));
}

namespace {

// Vergence over signed blur, a straight line: V = V0 - c/(A v).
struct VergenceLine {
  double mean_blur = 0.0;
  double mean_vergence = 0.0;
  double slope = 0.0;
  double weights = 0.0;
  double spread = 0.0;  // sum of w (c - mean)^2

  double at(double blur) const { return mean_vergence + slope * (blur - mean_blur); }
  double standard_error(double blur) const {
    const double from = blur - mean_blur;
    return std::abs(slope) * std::sqrt(1.0 / weights + from * from / spread);
  }
};

struct BlurPoint {
  double blur = 0.0;  // metres, near negative
  double vergence = 0.0;
  double error = 0.0;
};

VergenceLine line_through(const std::vector<BlurPoint>& points) {
  VergenceLine line;
  for (const BlurPoint& p : points) {
    const double w = 1.0 / (p.error * p.error);
    line.weights += w;
    line.mean_blur += w * p.blur;
    line.mean_vergence += w * p.vergence;
  }
  line.mean_blur /= line.weights;
  line.mean_vergence /= line.weights;
  double products = 0.0;
  for (const BlurPoint& p : points) {
    const double w = 1.0 / (p.error * p.error);
    const double from = p.blur - line.mean_blur;
    line.spread += w * from * from;
    products += w * from * (p.vergence - line.mean_vergence);
  }
  line.slope = products / line.spread;
  return line;
}

}  // namespace

void check_depth_of_field(VerificationRun& run) {
  constexpr int kSide = 160;  // px: what is acceptably sharp is small, and pixels with it
  const VerificationCheck& check = run.check();
  const double limit = check.coc_limit.si();
  std::vector<BlurPoint> points;
  VerificationCurve curve{
      .title = "Signed blur over vergence", .x_label = "1/object distance (1/m)", .y_label = "um"};
  const auto photograph = [&](Length distance, double sign, double share) {
    if (distance == kInfinitelyFar) return;
    const MeasuredDisc disc = measured_disc(run, check, distance, kSide, kDiscWide);
    points.push_back({.blur = sign * disc.diameter.si(),
                      .vergence = 1.0 / distance.si(),
                      .error = disc.standard_error.si()});
    curve.x.push_back(points.back().vergence);
    curve.measured.push_back(1e6 * points.back().blur);
    curve.expected.push_back(1e6 * sign * share * limit);
  };
  for (const double share : {0.6, 1.0, 1.4}) {
    const ExpectedDepthOfField ends =
        expected_depth_of_field(check.camera, share * check.coc_limit);
    photograph(ends.near, -1.0, share);
    photograph(ends.far, 1.0, share);
  }
  const VergenceLine line = line_through(points);
  const ExpectedDepthOfField expected = expected_depth_of_field(check.camera, check.coc_limit);
  for (const auto& [name, sign, distance] :
       {std::tuple{"near limit", -1.0, expected.near}, {"far limit", 1.0, expected.far}}) {
    if (distance == kInfinitelyFar) continue;
    const double measured = 1.0 / line.at(sign * limit);
    const double error = measured * measured * line.standard_error(sign * limit);
    run.add({.name = std::string(name) + " of depth of field, through " +
                     std::to_string(points.size()) + " discs",
             .unit = "m",
             .measured = measured,
             .expected = distance.si(),
             .shares = {{"sampling noise", kStandardErrors * error}},
             .largest_tolerance = 0.004 * distance.si(),
             .is_fit = true});
  }
  run.add(std::move(curve));
}

void check_brightness(VerificationRun& run) {
  constexpr int kSide = 32;
  constexpr Length kWallDistance = Length::si(2.0);  // in focus or not: it fills all
  const std::vector<double> f_numbers = f_numbers_of(run.check());
  VerificationCurve curve{.title = "Pixel value under ISO exposure",
                          .x_label = "f-number",
                          .y_label = "value of radiance 1"};
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (const double f_number : f_numbers) {
    const VerificationCheck one = with_f_number(run.check(), f_number);
    SimulationSpec shot = chart_shot(one, smallest_pitch(kSide), kSide, kSide);
    if (!shot.quality.samples) shot.quality.samples = 16;
    const Image image = run.picture(shot, wall_chart(shot, kWallDistance));
    double sum = 0.0, squares = 0.0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const double value = image.at(x, y)[kGreen];
        sum += value;
        squares += value * value;
      }
    }
    const double mean = sum / (kSide * kSide);
    const double variance = std::max(0.0, squares / (kSide * kSide) - mean * mean);
    const double expected = expected_exposure(one.camera);
    // A wall has no noise: what remains is single precision, of samples and of their sum.
    run.add({.name = "value of radiance 1 at " + f_number_text(f_number),
             .measured = mean,
             .expected = expected,
             .shares = {{"single precision", 4e-6 * expected},
                        {"sampling noise",
                         kStandardErrors * kBlockFactor * std::sqrt(variance) / kSide}},
             .largest_tolerance = 1e-3 * expected});
    curve.x.push_back(f_number);
    curve.measured.push_back(mean);
    curve.expected.push_back(expected);
    const double log_n = std::log(f_number), log_value = std::log(std::max(mean, 1e-300));
    sx += log_n;
    sy += log_value;
    sxx += log_n * log_n;
    sxy += log_n * log_value;
  }
  const auto n = static_cast<double>(f_numbers.size());
  if (f_numbers.size() >= 3) {
    run.add({.name = "power of the f-number that brightness follows, fitted",
             .measured = (n * sxy - sx * sy) / (n * sxx - sx * sx),
             .expected = -2.0,
             .shares = {{"single precision", 1e-4}},
             .largest_tolerance = 0.004,
             .is_fit = true});
  }
  run.add(std::move(curve));
}

void check_breathing(VerificationRun& run) {
  constexpr int kWidth = 320;
  constexpr int kHeight = 80;
  constexpr int kHalfStrip = 88;
  constexpr int kRegion = 64;
  VerificationCurve curve{.title = "Magnification over focus",
                          .x_label = "focus distance (m)",
                          .y_label = "size on the sensor over size of the object"};
  for (const Length focus : focus_distances_of(run.check())) {
    const VerificationCheck one = with_focus(run.check(), focus);
    finite_focus(one.camera);  // or refuses
    const double nominal = expected_magnification(one.camera);
    const Length pitch = one.camera.sensor_width / kWidth;
    const Length width = 2.0 * kHalfStrip / nominal * pitch;
    SimulationSpec shot = chart_shot(one, pitch, kWidth, kHeight);
    if (!shot.quality.samples) shot.quality.samples = 256;
    const Image image = run.picture(shot, strip_chart(shot, focus, width));
    const auto edge_at = [&](int middle) {
      return measured_slanted_edge(
          image.view(),
          {.region = {.x = middle - kRegion / 2, .y = 0, .width = kRegion, .height = kHeight},
           .channel = kGreen});
    };
    const SlantedEdge left = edge_at(kWidth / 2 - kHalfStrip);
    const SlantedEdge right = edge_at(kWidth / 2 + kHalfStrip);
    const Vec2 between = right.point - left.point;
    const double apart = between.x * left.normal.x + between.y * left.normal.y;
    // An edge in focus is as steep as its pixel is wide: its place errs by the noise there over the
    // root of its length.
    const double noise = std::max(left.noise, right.noise) * std::sqrt(0.5 * kRegion);
    const double error = std::sqrt(2.0) * kBlockFactor * noise / std::sqrt(1.0 * kHeight);
    const double measured = apart * (pitch / width);
    const double per_pixel = pitch / width;
    const double expected =
        run.add({.name = "magnification, focus " + distance_text(focus),
                 .measured = measured,
                 .expected = nominal,
                 .shares = {{"sampling noise", kStandardErrors * error * per_pixel},
                            {"0.005 px of the profile's knots", 0.01 * per_pixel}},
                 .largest_tolerance = 0.004 * nominal});
    run.remember(measured, expected, std::max(error, 0.002) * per_pixel);
    curve.x.push_back(focus.si());
    curve.measured.push_back(measured);
    curve.expected.push_back(expected);
  }
  run.add_scale("all magnifications, one factor fitted");
  run.add(std::move(curve));
}

}  // namespace fstop
