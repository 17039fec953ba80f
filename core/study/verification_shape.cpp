// Checks of the blur's shape and of the focus that scores find.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/error.h"
#include "core/measure/sharpness.h"
#include "core/measure/spot.h"
#include "core/study/expected_optics.h"
#include "core/study/verification_chart.h"
#include "core/study/verification_checks.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kGreen = 1;
constexpr double kBlockFactor = 4.0;
// Side of the square that stands for a point: as wide as its moments allow, for less noise.
constexpr double kSourcePx = 12.0;

// Relative standard deviation of the pixels within `radius` of the centroid.
double plateau_noise(const Image& image, Vec2 centre, double radius) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (std::hypot(x + 0.5 - centre.x, y + 0.5 - centre.y) > radius) continue;
      const double value = image.at(x, y)[kGreen];
      sum += value;
      squares += value * value;
      ++count;
    }
  }
  const double mean = sum / std::max(1, count);
  if (!(mean > 0.0)) throw Error(ErrorCode::outside_domain, "the blur's middle is dark");
  return std::sqrt(std::max(0.0, squares / count - mean * mean)) / mean;
}

// Mean of (x + iy)^n about `centre`, raster y down, weighed by the values.
std::complex<double> harmonic(const Image& image, Vec2 centre, int n) {
  std::complex<double> sum = 0.0;
  double energy = 0.0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = image.at(x, y)[kGreen];
      sum += value * std::pow(std::complex(x + 0.5 - centre.x, y + 0.5 - centre.y), n);
      energy += value;
    }
  }
  return sum / energy;
}

struct IrisShot {
  VerificationCheck check = {};
  Length object = {};
  int blades = 0;
};

void measure_iris(VerificationRun& run, const IrisShot& iris) {
  constexpr double kDiscWide = 40.0;  // px
  const Length nominal = expected_blur_diameter(iris.check.camera, iris.object);
  const int side = 2 * static_cast<int>(0.8 * kDiscWide + 14.0);
  const Length pitch = std::max(nominal / kDiscWide, smallest_pitch(side));
  SimulationSpec shot = chart_shot(iris.check, pitch, side, side);
  if (!shot.quality.samples) shot.quality.samples = 2048;
  const double sensor = chart_sensor_distance(iris.check.camera);
  const Image image =
      run.picture(shot, point_chart(iris.object, kSourcePx * (iris.object.si() / sensor) * pitch));
  // A square's second moment is that of a disc sqrt(4/3) as wide.
  const Spot spot =
      measured_spot(image.view(), {.region = {0, 0, side, side},
                                   .channel = kGreen,
                                   .background = 0.0,
                                   .source_diameter = kSourcePx * std::sqrt(4.0 / 3.0),
                                   .blades = iris.blades});
  const double radius = 0.5 * (nominal / pitch);
  const double pixels = kPi * radius * radius;
  const double noise =
      kBlockFactor * plateau_noise(image, spot.centroid, 0.4 * radius) / std::sqrt(pixels);
  const std::string what =
      std::to_string(iris.blades) + " blades, object " + distance_text(iris.object);
  const double millimetres = nominal.si() * 1e3;
  // rho^2 of a disc has the mean R^2/2 and the deviation R^2/sqrt(12); a diameter has half of it.
  run.add({.name = "diameter of the disc of equal area, " + what,
           .unit = "mm",
           .measured = spot.disc_diameter * pitch.si() * 1e3,
           .expected = millimetres,
           .shares = {{"sampling noise", kStandardErrors * noise / std::sqrt(12.0) * millimetres},
                      {"sum over pixels", 1e-4 * millimetres}},
           .largest_tolerance = 0.01 * millimetres});
  const int n = iris.blades;
  const std::complex<double> moment = harmonic(image, spot.centroid, n);
  const double scale = 0.5 * (n + 1) * (n + 2);
  // rho^n of a disc deviates by R^n/sqrt(n + 1).
  const double moment_noise = kStandardErrors * noise * scale / std::sqrt(n + 1.0) / n;
  const double circumradius = expected_circumradius(nominal, n).si() * 1e3;
  run.add({.name = "distance of the corners from the middle, " + what,
           .unit = "mm",
           .measured = std::pow(scale * std::abs(moment), 1.0 / n) * pitch.si() * 1e3,
           .expected = circumradius,
           .shares = {{"sampling noise", moment_noise * circumradius},
                      {"sum over pixels", 1e-3 * circumradius}},
           .largest_tolerance = 0.02 * circumradius});
  // Behind the focused plane the blur stands as the iris does, before it turned by half a turn.
  const auto& lens = std::get<LensSpec>(iris.check.camera.optics);
  const double turned = lens.aperture.rotation + (iris.object < lens.focus_distance ? kPi : 0.0);
  const double period = 2.0 * kPi / n;
  const double found = std::arg(moment) / n;
  const double off = std::remainder(found - turned, period);
  const double expected = std::remainder(turned, period) * 180.0 / kPi;
  run.add({.name = "direction of a corner, " + what,
           .unit = "deg",
           .measured = expected + off * 180.0 / kPi,
           .expected = expected,
           .shares = {{"sampling noise", moment_noise * 180.0 / kPi}, {"sum over pixels", 0.05}},
           .largest_tolerance = 2.0});
}

}  // namespace

void check_bokeh_shape(VerificationRun& run) {
  if (run.check().blades.empty()) throw Error(ErrorCode::outside_domain, "needs blades");
  for (const int blades : run.check().blades) {
    if (blades < 3) throw Error(ErrorCode::outside_domain, "blades must be 3 or more");
    for (const Length object : object_distances_of(run.check())) {
      IrisShot iris{.check = run.check(), .object = object, .blades = blades};
      auto* lens = std::get_if<LensSpec>(&iris.check.camera.optics);
      if (lens == nullptr)
        throw Error(ErrorCode::outside_domain, "this check needs a camera with a lens");
      lens->aperture.blades = blades;
      measure_iris(run, iris);
    }
  }
}

namespace {

struct FocusSeries {
  double centre = 0.0;  // expected vergence, 1/m
  double step = 0.0;
  std::vector<double> scores = {};  // from -half to +half steps
};

// Where a score is as large on the right of the top as the given one on its left: ln scores are
// taken for straight lines between pictures.
std::optional<double> partner(const FocusSeries& series, double score) {
  const auto half = static_cast<int>(series.scores.size() / 2);
  for (int k = 1; k < half; ++k) {
    const double near = series.scores[static_cast<std::size_t>(half + k)];
    const double far = series.scores[static_cast<std::size_t>(half + k + 1)];
    if (near < score || far > score) continue;
    const double share = std::log(near / score) / std::log(near / far);
    return series.centre + (k + share) * series.step;
  }
  return std::nullopt;
}

// The middle between equal scores on both sides, and how it scatters.
void add_peak(VerificationRun& run, const FocusSeries& series, const std::string& score,
              double image_distance) {
  std::vector<double> middles;
  const auto half = static_cast<int>(series.scores.size() / 2);
  for (int k = 1; k <= half; ++k) {
    const double left = series.centre - k * series.step;
    const auto right = partner(series, series.scores[static_cast<std::size_t>(half - k)]);
    if (right) middles.push_back(0.5 * (left + *right));
  }
  if (middles.size() < 2) {
    throw Error(ErrorCode::outside_domain,
                score + " has no top about the object's distance: no two scores agree");
  }
  double mean = 0.0, squares = 0.0;
  for (const double middle : middles) mean += middle / static_cast<double>(middles.size());
  for (const double middle : middles) squares += std::pow(middle - mean, 2);
  const auto n = static_cast<double>(middles.size());
  const double error = std::sqrt(squares / (n - 1.0) / n);
  const double distance = 1.0 / series.centre;
  const double per_vergence = distance * distance;
  const double reach = half * series.step;
  run.add({.name = "focus with the largest " + score,
           .unit = "m",
           .measured = 1.0 / mean,
           .expected = distance,
           .shares = {{"scatter of the middles", kStandardErrors * error * per_vergence},
                      {"a twentieth of the focus step", 0.05 * series.step * per_vergence},
                      // The sensor moves: discs grow with v, which differs by v^2 dV.
                      {"the sensor's way", 0.5 * image_distance * reach * reach * per_vergence}},
           .largest_tolerance = series.step * per_vergence});
}

}  // namespace

void check_focus_peak(VerificationRun& run) {
  constexpr int kSide = 96;
  constexpr int kHalf = 5;         // pictures on either side
  constexpr double kStepPx = 1.5;  // the disc's growth from one picture to the next
  const Length object = object_distances_of(run.check()).front();
  const VerificationCheck focused = with_focus(run.check(), object);
  const auto& lens = std::get<LensSpec>(focused.camera.optics);
  const double v = chart_sensor_distance(focused.camera);
  const Length pitch = smallest_pitch(kSide);
  const double pupil = lens.lens.focal_length.si() / lens.lens.f_number;
  FocusSeries laplacian{.centre = 1.0 / object.si(), .step = kStepPx * pitch.si() / (pupil * v)};
  if (laplacian.centre - kHalf * laplacian.step <= 0.0)
    throw Error(ErrorCode::outside_domain, "object_distances_m is too far for a focus series");
  FocusSeries tenengrad = laplacian;
  VerificationCurve curve{
      .title = "Tenengrad over focus", .x_label = "1/focus distance (1/m)", .y_label = "score"};
  for (int k = -kHalf; k <= kHalf; ++k) {
    const double vergence = laplacian.centre + k * laplacian.step;
    const VerificationCheck one = with_focus(run.check(), Length::si(1.0 / vergence));
    SimulationSpec shot = chart_shot(one, pitch, kSide, kSide);
    if (!shot.quality.samples) shot.quality.samples = 256;
    const Image image = run.picture(shot, edge_chart(shot, object));
    const PixelRegion region{.x = 0, .y = 0, .width = kSide, .height = kSide};
    laplacian.scores.push_back(
        sharpness(SharpnessScore::variance_of_laplacian, image.view(), kGreen, region));
    tenengrad.scores.push_back(sharpness(SharpnessScore::tenengrad, image.view(), kGreen, region));
    curve.x.push_back(vergence);
    curve.measured.push_back(tenengrad.scores.back());
  }
  add_peak(run, laplacian, "variance of the Laplacian", v);
  add_peak(run, tenengrad, "Tenengrad", v);
  run.add(std::move(curve));
}

}  // namespace fstop
