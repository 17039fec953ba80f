// Checks of transfer: slanted edges out of focus, at the diffraction limit and behind pinholes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/measure/profile_scale.h"
#include "core/study/expected_optics.h"
#include "core/study/verification_chart.h"
#include "core/study/verification_checks.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kGreen = 1;
constexpr double kBlockFactor = 4.0;  // pixels of a block share points of the pupil
// What the slanted edge's own profile leaves of 1 up to 1 cycle/px (slanted_edge.h).
constexpr double kSplineError = 5e-4;
constexpr double kFitTolerance = 0.004;

double sinc(double x) { return std::abs(x) < 1e-9 ? 1.0 : std::sin(kPi * x) / (kPi * x); }

// The pixel's square along the edge's normal.
double pixel_transfer(double cycles_per_px) {
  return sinc(cycles_per_px * std::cos(kChartSlant)) * sinc(cycles_per_px * std::sin(kChartSlant));
}

// Diffracted light reaches far: what lies outside a frame is left out of its picture far enough
// away, so that the middle alone is measured.
constexpr int kWindow = 128;  // px

SlantedEdgeSpec middle_of(const SimulationSpec& shot) {
  const int side = std::min({kWindow, shot.width, shot.height});
  return {.region = {.x = (shot.width - side) / 2,
                     .y = (shot.height - side) / 2,
                     .width = side,
                     .height = side},
          .channel = kGreen};
}

SlantedEdge edge_of(const Image& image, const SimulationSpec& shot) {
  SlantedEdgeSpec spec = middle_of(shot);
  spec.levels = EdgeLevels{.dark = 0.0, .bright = 1.0};
  return measured_slanted_edge(image.view(), spec);
}

// What the profile's taper takes off the transfer at `nu` where the line's image has a tail p/x^2:
// the missing light, 2 p/F from F px on, turns under the cosine and leaves at most its height over
// pi nu.
double tail_error(const SlantedEdge& edge, double tail, double nu) {
  const double full = std::min(0.8 * edge.reach, 2.0 * edge.rise_10_90 + 4.0);
  return std::min(2.0 * tail / full, tail / (full * full) / (kPi * nu));
}

struct TransferCurve {
  Length pitch = {};
  TransferFunction expected = {};  // of the blur alone
  double tail = 0.0;               // p of its line's image, px
  double lowest = 0.02;            // cycles/px that are compared
  double highest = 0.5;
};

// The edge's transfer beside theory; the result is the largest difference.
void add_transfer(VerificationRun& run, const SlantedEdge& edge, const TransferCurve& theory,
                  const std::string& what) {
  VerificationCurve curve{
      .title = "Transfer, " + what, .x_label = "frequency (cycles/mm)", .y_label = "contrast kept"};
  double worst = 0.0, allowed = 0.0, noise_share = 0.0, tail_share = 0.0;
  const double pitch = theory.pitch.si();
  for (double nu = theory.lowest; nu <= theory.highest + 1e-9; nu += 0.01) {
    const double measured = transfer(edge.line_spread, nu).real();
    const double expected = theory.expected(nu / pitch) * pixel_transfer(nu);
    // Over a region as wide as long a pixel's noise s enters the transform of the edge with
    // s sqrt(1/2), and its derivative with 2 pi nu times that.
    const double noise =
        kStandardErrors * kBlockFactor * edge.noise * std::sqrt(0.5) * 2.0 * kPi * nu;
    const double tail = tail_error(edge, theory.tail, nu);
    if (std::abs(measured - expected) - noise - tail > worst - allowed || allowed == 0.0) {
      worst = std::abs(measured - expected);
      noise_share = noise;
      tail_share = tail;
      allowed = noise + tail;
    }
    curve.x.push_back(nu / pitch / 1e3);
    curve.measured.push_back(measured);
    curve.expected.push_back(expected);
  }
  std::vector<ToleranceShare> shares = {{"the profile's splines", kSplineError},
                                        {"sampling noise", noise_share}};
  if (theory.tail > 0.0) shares.push_back({"light beyond the profile's end", tail_share});
  run.add({.name = "largest difference of the transfer, " + what,
           .unit = "of contrast",
           .measured = worst,
           .expected = 0.0,
           .shares = std::move(shares),
           .largest_tolerance = 0.05});
  run.add(std::move(curve));
}

VerificationResult fitted(std::string name, std::string unit, double nominal, double factor,
                          double standard_error) {
  return {.name = std::move(name),
          .unit = std::move(unit),
          .measured = nominal * factor,
          .expected = nominal,
          .shares = {{"noise of the fit", kStandardErrors * standard_error * nominal}},
          .largest_tolerance = kFitTolerance * nominal,
          .is_fit = true};
}

}  // namespace

void check_defocus_mtf(VerificationRun& run) {
  constexpr int kSide = 112;
  constexpr double kWide = 10.0;  // px: two zeros of the disc below Nyquist
  const VerificationCheck& check = run.check();
  for (const Length object : object_distances_of(check)) {
    const Length nominal = expected_blur_diameter(check.camera, object);
    const Length pitch = std::max(nominal / kWide, smallest_pitch(kSide));
    require_blurred(nominal, pitch);
    SimulationSpec shot = chart_shot(check, pitch, kSide, kSide);
    if (!shot.quality.samples) shot.quality.samples = 1024;
    const Image image = run.picture(shot, edge_chart(shot, object));
    const TransferFunction disc = disc_transfer(nominal);
    const ProfileScale fit =
        fit_profile_scale(image.view(), middle_of(shot),
                          [&](double nu, double scale) { return disc(nu * scale / pitch.si()); });
    const std::string what = "object " + distance_text(object);
    run.add(fitted("blur diameter by the whole profile, " + what, "mm", nominal.si() * 1e3,
                   fit.scale, fit.standard_error));
    add_transfer(run, edge_of(image, shot), {.pitch = pitch, .expected = disc}, what);
  }
}

void check_diffraction_mtf(VerificationRun& run) {
  constexpr double kCutOff = 0.33;  // cycles/px: the pixel takes little of what is below
  constexpr int kSmallestSide = 256;
  constexpr int kLargestSide = 512;
  for (const double f_number : f_numbers_of(run.check())) {
    VerificationCheck one = with_f_number(run.check(), f_number);
    if (one.method.empty()) one.method = "wave";
    const double nominal = expected_cut_off(one.camera).si();
    const Length pitch = std::max(Length::si(kCutOff / nominal), smallest_pitch(kLargestSide));
    const int side = std::max(kSmallestSide, static_cast<int>(std::ceil(1.05e-3 / pitch.si())));
    SimulationSpec shot = chart_shot(one, pitch, side, side);
    shot.camera.monochromatic = true;
    shot.effects.diffraction = EffectChoice::on;
    shot.quality.max_error = 0.002;
    if (!shot.quality.samples) shot.quality.samples = 64;
    const Length focus = finite_focus(one.camera);
    const Image image = run.picture(shot, edge_chart(shot, focus));
    const TransferFunction theory = diffraction_transfer(one.camera);
    const ProfileScale fit =
        fit_profile_scale(image.view(), middle_of(shot),
                          [&](double nu, double scale) { return theory(nu * scale / pitch.si()); });
    VerificationResult result =
        fitted("cut-off frequency at " + f_number_text(f_number) + " by the whole profile",
               "cycles/mm", nominal / 1e3, 1.0 / fit.scale, fit.standard_error);
    // Scalar paraxial waves: their relative error is about the square of the cone's half-angle.
    const double cone = 0.5 * nominal * one.camera.wavelength.si();
    result.shares.push_back({"paraxial waves", cone * cone * nominal / 1e3});
    run.add(std::move(result));
    const double cut_off_px = nominal * pitch.si();
    add_transfer(run, edge_of(image, shot),
                 {.pitch = pitch,
                  .expected = theory,
                  .tail = 1.0 / (kPi * kPi * cut_off_px),
                  .lowest = 0.05,
                  .highest = std::min(0.5, 1.1 * cut_off_px)},
                 f_number_text(f_number));
  }
}

namespace {

// The lowest frequency at which `otf` has fallen to half, cycles/px.
double half_frequency(const std::function<double(double)>& otf) {
  constexpr double kStep = 1.0 / 512.0;
  double low = 0.0;
  while (otf(low + kStep) > 0.5) low += kStep;
  double high = low + kStep;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (otf(middle) > 0.5 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Top of the parabola through (x, y) by least squares, x from their mean.
double parabola_top(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mean = 0.0;
  for (const double v : x) mean += v / n;
  double s2 = 0.0, s3 = 0.0, s4 = 0.0, t0 = 0.0, t1 = 0.0, t2 = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double u = x[i] - mean;
    s2 += u * u;
    s3 += u * u * u;
    s4 += u * u * u * u;
    t0 += y[i];
    t1 += u * y[i];
    t2 += u * u * y[i];
  }
  // a + b u + c u^2 with sum u = 0: b and c from two equations.
  const double q4 = s4 - s2 * s2 / n;
  const double q2 = t2 - s2 * t0 / n;
  const double det = s2 * q4 - s3 * s3;
  const double b = (t1 * q4 - s3 * q2) / det;
  const double c = (s2 * q2 - s3 * t1) / det;
  if (!(c < 0.0))
    throw Error(ErrorCode::outside_domain,
                "no diameter is sharpest: the sharpness has no top among diameters_mm");
  return mean - b / (2.0 * c);
}

struct HoleSharpness {
  std::vector<double> log_diameter = {};
  std::vector<double> measured = {};  // ln MTF50
  std::vector<double> expected = {};
};

void add_optimum(VerificationRun& run, const HoleSharpness& holes) {
  // MTF50 by ISO 12233 of a profile that ends: 0.006 of contrast over its slope there, 0.6.
  constexpr double kSingleNumber = 0.01;
  const double expected = std::exp(parabola_top(holes.log_diameter, holes.expected)) * 1e3;
  const double measured = std::exp(parabola_top(holes.log_diameter, holes.measured)) * 1e3;
  double allowed = 0.0;
  for (std::size_t i = 0; i < holes.expected.size(); ++i) {
    std::vector<double> changed = holes.expected;
    changed[i] += kSingleNumber;
    allowed += std::abs(std::exp(parabola_top(holes.log_diameter, changed)) * 1e3 - expected);
  }
  run.add({.name = "diameter of the sharpest hole, by MTF50",
           .unit = "mm",
           .measured = measured,
           .expected = expected,
           .shares = {{"1 % of each MTF50", allowed}},
           .largest_tolerance = 0.25 * expected});
}

}  // namespace

void check_pinhole_optimum(VerificationRun& run) {
  constexpr int kSide = 256;
  constexpr double kPixels = 6.0;  // in sqrt(z lambda)
  const VerificationCheck& check = run.check();
  const auto* hole = std::get_if<PinholeSpec>(&check.camera.optics);
  if (hole == nullptr)
    throw Error(ErrorCode::outside_domain, "this check needs a camera with a pinhole");
  if (check.object_distances.size() != 1 || check.diameters.size() < 4) {
    throw Error(ErrorCode::outside_domain,
                "needs one of object_distances_m and four or more diameters_mm");
  }
  const Length object = check.object_distances.front();
  const double z = hole->image_distance.si();
  const double lambda = check.camera.wavelength.si();
  const Length pitch = std::max(Length::si(std::sqrt(z * lambda) / kPixels), smallest_pitch(kSide));
  HoleSharpness holes;
  VerificationCurve curve{.title = "Frequency of half contrast over the hole",
                          .x_label = "diameter (mm)",
                          .y_label = "cycles/mm"};
  double weights = 0.0, weighted = 0.0;
  for (const Length diameter : check.diameters) {
    VerificationCheck one = check;
    one.camera.optics = PinholeSpec{.image_distance = hole->image_distance, .diameter = diameter};
    if (one.method.empty()) one.method = "wave";
    SimulationSpec shot = chart_shot(one, pitch, kSide, kSide);
    shot.camera.monochromatic = true;
    shot.effects.diffraction = EffectChoice::on;
    shot.quality.max_error = 0.002;
    if (!shot.quality.samples) shot.quality.samples = 64;
    const Image image = run.picture(shot, edge_chart(shot, object));
    const auto scaled = [&](bool by_wavelength) {
      return [&, by_wavelength](double nu, double scale) {
        CameraSpec camera = one.camera;
        if (by_wavelength) {
          camera.wavelength *= scale;
        } else {
          std::get<PinholeSpec>(camera.optics).diameter *= scale;
        }
        return pinhole_transfer(camera, object)(nu / pitch.si());
      };
    };
    const ProfileScale by_wavelength =
        fit_profile_scale(image.view(), middle_of(shot), scaled(true));
    const double weight = 1.0 / std::pow(by_wavelength.standard_error, 2);
    weights += weight;
    weighted += weight * by_wavelength.scale;

    const TransferFunction theory = pinhole_transfer(one.camera, object);
    const auto otf = [&](double nu) { return theory(nu / pitch.si()) * pixel_transfer(nu); };
    const double expected = half_frequency(otf);
    const double measured = edge_of(image, shot).mtf50;
    holes.log_diameter.push_back(std::log(diameter.si()));
    holes.expected.push_back(std::log(expected));
    holes.measured.push_back(std::log(measured));
    curve.x.push_back(diameter.si() * 1e3);
    curve.measured.push_back(measured / pitch.si() / 1e3);
    curve.expected.push_back(expected / pitch.si() / 1e3);
  }
  VerificationResult wavelength = fitted(
      "wavelength by the whole profiles of " + std::to_string(check.diameters.size()) + " holes",
      "nm", lambda * 1e9, weighted / weights, 1.0 / std::sqrt(weights));
  // Over the window's half-width t the zones number as cos^3, and the cone widens as 1/cos^3.
  const double field = 0.5 * kWindow * pitch.si() / z;
  wavelength.shares.push_back({"the field's angle", 0.5 * field * field * lambda * 1e9});
  run.add(std::move(wavelength));
  add_optimum(run, holes);
  run.add(std::move(curve));
}

}  // namespace fstop
