#include "core/study/verification.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/study/verification_checks.h"

namespace fstop {
namespace {

LensSpec& lens_of(CameraSpec& camera) {
  auto* lens = std::get_if<LensSpec>(&camera.optics);
  if (lens == nullptr)
    throw Error(ErrorCode::outside_domain, "this check needs a camera with a lens");
  return *lens;
}

// What a renderer or a measurement may refuse; all else ends the verification.
bool is_verdict(ErrorCode code) {
  return code != ErrorCode::io_failure && code != ErrorCode::cancelled &&
         code != ErrorCode::internal;
}

void run_check(VerificationRun& run) {
  switch (run.check().kind) {
    case VerificationKind::blur:
      return check_blur(run);
    case VerificationKind::depth_of_field:
      return check_depth_of_field(run);
    case VerificationKind::brightness:
      return check_brightness(run);
    case VerificationKind::breathing:
      return check_breathing(run);
    case VerificationKind::defocus_mtf:
      return check_defocus_mtf(run);
    case VerificationKind::diffraction_mtf:
      return check_diffraction_mtf(run);
    case VerificationKind::pinhole_optimum:
      return check_pinhole_optimum(run);
    case VerificationKind::bokeh_shape:
      return check_bokeh_shape(run);
    case VerificationKind::focus_peak:
      return check_focus_peak(run);
  }
}

}  // namespace

std::string_view verification_kind_name(VerificationKind kind) {
  switch (kind) {
    case VerificationKind::blur:
      return "blur";
    case VerificationKind::depth_of_field:
      return "depth-of-field";
    case VerificationKind::brightness:
      return "brightness";
    case VerificationKind::breathing:
      return "breathing";
    case VerificationKind::defocus_mtf:
      return "defocus-mtf";
    case VerificationKind::diffraction_mtf:
      return "diffraction-mtf";
    case VerificationKind::pinhole_optimum:
      return "pinhole-optimum";
    case VerificationKind::bokeh_shape:
      return "bokeh-shape";
    case VerificationKind::focus_peak:
      return "focus-peak";
  }
  return {};
}

double VerificationResult::tolerance() const {
  return std::accumulate(shares.begin(), shares.end(), 0.0,
                         [](double sum, const ToleranceShare& share) { return sum + share.size; });
}

bool VerificationResult::holds() const {
  return is_decisive() && std::abs(measured - expected) <= tolerance();
}

bool VerificationOutcome::holds() const {
  return failure.empty() && !results.empty() &&
         std::ranges::all_of(results, [](const auto& result) { return result.holds(); });
}

VerificationOutcome verified(const VerificationCheck& check, const Photographer& photographer) {
  VerificationOutcome outcome{.check = check.name, .kind = check.kind, .camera = check.camera_name};
  VerificationRun run(check, photographer, outcome);
  try {
    run_check(run);
    if (check.expected.size() > outcome.results.size()) {
      throw Error(ErrorCode::outside_domain, "has " + std::to_string(outcome.results.size()) +
                                                 " results, but expected has " +
                                                 std::to_string(check.expected.size()) + " values");
    }
  } catch (const Error& error) {
    if (!is_verdict(error.code())) throw;
    outcome.failure = error.what();
  }
  return outcome;
}

std::string_view planted_error_name(PlantedError error) {
  switch (error) {
    case PlantedError::focal_length:
      return "focal length";
    case PlantedError::aperture:
      return "aperture";
    case PlantedError::wavelength:
      return "wavelength";
  }
  return {};
}

ChartShot with_planted(ChartShot shot, PlantedError error, double factor) {
  CameraSpec& camera = shot.shot.camera;
  auto* lens = std::get_if<LensSpec>(&camera.optics);
  auto* hole = std::get_if<PinholeSpec>(&camera.optics);
  switch (error) {
    case PlantedError::focal_length:
      if (lens != nullptr) lens->lens.focal_length *= factor;
      if (hole != nullptr) hole->image_distance *= factor;
      break;
    case PlantedError::aperture:
      if (lens != nullptr) lens->lens.f_number *= factor;
      if (hole != nullptr) hole->diameter *= factor;
      break;
    case PlantedError::wavelength:
      camera.wavelength *= factor;
      break;
  }
  return shot;
}

bool can_show(const VerificationCheck& check, PlantedError error) {
  const bool is_wave = check.kind == VerificationKind::diffraction_mtf ||
                       check.kind == VerificationKind::pinhole_optimum;
  switch (error) {
    case PlantedError::wavelength:
      return is_wave;
    case PlantedError::aperture:
      return check.kind != VerificationKind::breathing &&
             check.kind != VerificationKind::focus_peak;
    case PlantedError::focal_length:
      // Brightness and cut-off change by the magnification's change alone.
      return check.kind != VerificationKind::diffraction_mtf &&
             check.kind != VerificationKind::brightness &&
             check.kind != VerificationKind::focus_peak;
  }
  return false;
}

Length smallest_pitch(int side) { return Length::si(1.05e-3) / side; }

std::string f_number_text(double f_number) {
  char text[32];
  std::snprintf(text, sizeof text, "f/%.3g", f_number);
  return text;
}

std::string distance_text(Length distance) {
  if (distance == kInfinitelyFar) return "infinity";
  char text[32];
  std::snprintf(text, sizeof text, "%.4g m", distance.si());
  return text;
}

VerificationCheck with_focus(VerificationCheck check, Length focus_distance) {
  lens_of(check.camera).focus_distance = focus_distance;
  return check;
}

VerificationCheck with_f_number(VerificationCheck check, double f_number) {
  lens_of(check.camera).lens.f_number = f_number;
  return check;
}

std::vector<Length> focus_distances_of(const VerificationCheck& check) {
  if (!check.focus_distances.empty()) return check.focus_distances;
  CameraSpec camera = check.camera;
  return {lens_of(camera).focus_distance};
}

std::vector<double> f_numbers_of(const VerificationCheck& check) {
  if (!check.f_numbers.empty()) return check.f_numbers;
  CameraSpec camera = check.camera;
  return {lens_of(camera).lens.f_number};
}

std::vector<Length> object_distances_of(const VerificationCheck& check) {
  if (!check.object_distances.empty()) return check.object_distances;
  CameraSpec camera = check.camera;
  return {lens_of(camera).focus_distance};
}

void require_blurred(Length blur_diameter, Length pitch) {
  if (!(blur_diameter > 0.5 * pitch)) {
    throw Error(ErrorCode::outside_domain,
                "the object is in focus: its blur is under half a pixel of the chart's picture");
  }
}

Length finite_focus(const CameraSpec& camera) {
  CameraSpec copy = camera;
  const Length focus = lens_of(copy).focus_distance;
  if (focus == kInfinitelyFar)
    throw Error(ErrorCode::outside_domain, "this check needs a lens focused nearer than infinity");
  return focus;
}

Image VerificationRun::picture(const SimulationSpec& shot, const Scene& scene) {
  Image image = photographer_({.shot = shot, .scene = scene});
  if (image.width() != shot.width || image.height() != shot.height || image.channels() != 3) {
    throw Error(ErrorCode::bad_image, "the picture has another size than was asked for");
  }
  if (outcome_.pictures++ == 0) outcome_.picture = image;
  return image;
}

double VerificationRun::add(VerificationResult result) {
  const std::size_t index = outcome_.results.size();
  if (index < check_.expected.size() && check_.expected[index]) {
    result.expected = *check_.expected[index];
    if (check_.further_tolerance > 0.0) {
      const double further = check_.further_tolerance * std::abs(result.expected);
      result.shares.push_back({"the suite's own", further});
      result.largest_tolerance += further;
    }
  }
  outcome_.results.push_back(std::move(result));
  return outcome_.results.back().expected;
}

void VerificationRun::add_scale(const std::string& what) {
  if (points_.size() < 3) return;
  double products = 0.0, squares = 0.0;
  for (const Point& p : points_) {
    const double weight = 1.0 / (p.standard_error * p.standard_error);
    products += weight * p.measured * p.expected;
    squares += weight * p.expected * p.expected;
  }
  const double further = check_.expected.empty() ? 0.0 : check_.further_tolerance;
  VerificationResult result{.name = what,
                            .unit = "of expected",
                            .measured = products / squares,
                            .expected = 1.0,
                            .shares = {{"sampling noise", kStandardErrors / std::sqrt(squares)}},
                            .largest_tolerance = 0.004 + further,
                            .is_fit = true};
  if (further > 0.0) result.shares.push_back({"the suite's own", further});
  outcome_.results.push_back(std::move(result));
}

}  // namespace fstop
