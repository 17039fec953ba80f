#pragma once

#include <string>
#include <vector>

#include "core/measure/slanted_edge.h"
#include "core/study/verification.h"

namespace fstop {

/// Standard errors that a result may be away from its closed form: beyond 4 a normal error lies
/// once in 16,000, so that a hundred results raise a false alarm once in 160 builds.
inline constexpr double kStandardErrors = 4.0;

/// A sensor is at least 1 mm wide; a picture of `side` pixels has pixels of at least this pitch.
Length smallest_pitch(int side);

/// "f/2.8", "2 m", "infinity".
std::string f_number_text(double f_number);
std::string distance_text(Length distance);

/// The check as one of its combinations has it: lists replaced by the camera's own values.
VerificationCheck with_focus(VerificationCheck check, Length focus_distance);
VerificationCheck with_f_number(VerificationCheck check, double f_number);

/// The camera's own value where a list is empty. Throw: Error{outside_domain} where it has none.
std::vector<Length> focus_distances_of(const VerificationCheck& check);
std::vector<double> f_numbers_of(const VerificationCheck& check);
/// The focused plane where the list is empty.
std::vector<Length> object_distances_of(const VerificationCheck& check);

/// Runs one check: takes its pictures, and adds what was measured in them to the outcome.
class VerificationRun {
 public:
  VerificationRun(const VerificationCheck& check, const Photographer& photographer,
                  VerificationOutcome& outcome)
      : check_(check), photographer_(photographer), outcome_(outcome) {}

  const VerificationCheck& check() const { return check_; }
  /// Keeps the first picture for the report.
  Image picture(const SimulationSpec& shot, const Scene& scene);
  /// `result.expected`: the closed form, which the check's own number replaces. Returns what is
  /// expected in the end.
  double add(VerificationResult result);
  void add(VerificationCurve curve) { outcome_.curves.push_back(std::move(curve)); }
  /// Keeps a value for add_scale.
  void remember(double measured, double expected, double standard_error) {
    points_.push_back({measured, expected, standard_error});
  }
  /// Adds the factor between all measured and all expected values that were kept, weighed by their
  /// standard errors, where there are three or more.
  void add_scale(const std::string& what);

 private:
  struct Point {
    double measured = 0.0;
    double expected = 0.0;
    double standard_error = 0.0;
  };

  const VerificationCheck& check_;
  const Photographer& photographer_;
  VerificationOutcome& outcome_;
  std::vector<Point> points_ = {};
};

/// Throws: Error{outside_domain} where a blur is under half a pixel: there is nothing to measure.
void require_blurred(Length blur_diameter, Length pitch);
/// The camera's focus. Throws: Error{outside_domain} for a lens focused at infinity, where no chart
/// can stand.
Length finite_focus(const CameraSpec& camera);

/// A blur disc as its edge shows it, on the sensor.
struct MeasuredDisc {
  Length diameter = {};
  Length standard_error = {};
};
/// Photographs an edge at `object_distance` with `side` x `side` pixels, the disc of about `wide`
/// px, and fits a disc to it.
MeasuredDisc measured_disc(VerificationRun& run, const VerificationCheck& check,
                           Length object_distance, int side, double wide);

void check_blur(VerificationRun& run);
void check_depth_of_field(VerificationRun& run);
void check_brightness(VerificationRun& run);
void check_breathing(VerificationRun& run);
void check_defocus_mtf(VerificationRun& run);
void check_diffraction_mtf(VerificationRun& run);
void check_pinhole_optimum(VerificationRun& run);
void check_bokeh_shape(VerificationRun& run);
void check_focus_peak(VerificationRun& run);

}  // namespace fstop
