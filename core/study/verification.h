#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/image.h"
#include "core/render/simulation.h"
#include "core/scene/scene.h"

namespace fstop {

/// What a check photographs and measures; suites name them by verification_kind_name().
enum class VerificationKind {
  blur,             ///< blur discs over focus, aperture and distance, at slanted edges
  depth_of_field,   ///< the distances where the disc reaches a limit
  brightness,       ///< 1/N_w^2 under ISO exposure
  breathing,        ///< magnification over focus
  defocus_mtf,      ///< a slanted edge's transfer out of focus: the disc's
  diffraction_mtf,  ///< in focus, one wavelength: the cut-off
  pinhole_optimum,  ///< transfer through holes, and the diameter that is sharpest
  bokeh_shape,      ///< area and corners of bladed apertures' blur
  focus_peak        ///< where variance of Laplacian and Tenengrad are largest
};
std::string_view verification_kind_name(VerificationKind kind);

/// One check of one camera. Lists are crossed, the first named outermost; an empty one is the
/// camera's own value.
struct VerificationCheck {
  std::string name = {};
  VerificationKind kind = VerificationKind::blur;
  std::string camera_name = {};
  CameraSpec camera = {};                     // the nominal numbers that expected values come from
  std::vector<Length> focus_distances = {};   // blur, breathing
  std::vector<double> f_numbers = {};         // blur, brightness, diffraction_mtf
  std::vector<Length> object_distances = {};  // blur, defocus_mtf, pinhole_optimum, bokeh, peak
  std::vector<Length> diameters = {};         // pinhole_optimum, 3 or more
  std::vector<int> blades = {};               // bokeh_shape, each 3 or more
  Length coc_limit = Length::si(30e-6);       // depth_of_field
  int samples = 0;                            // a pixel; 0: the kind's own number
  std::string method = {};                    // empty: the kind's own
  /// By result, in their order; absent or null: the closed form. A camera's data sheet, say.
  std::vector<std::optional<double>> expected = {};
  double further_tolerance = 0.0;  // relative, of what `expected` says
};

/// Why a measurement may differ from its closed form, and by how much; in the result's unit.
struct ToleranceShare {
  std::string cause = {};
  double size = 0.0;
};

/// One measured number beside the number it must be.
struct VerificationResult {
  std::string name = {};  // "blur diameter, focus 2 m, f/2.8, object 5 m"
  std::string unit = {};  // "mm", "" for a ratio
  double measured = 0.0;
  double expected = 0.0;
  std::vector<ToleranceShare> shares = {};
  /// Beyond this a result says too little to be green, however well it agrees: a broken renderer's
  /// noise must not excuse it. In the result's unit.
  double largest_tolerance = 0.0;
  bool is_fit = false;  // of a whole profile

  double tolerance() const;  // the shares' sum
  bool is_decisive() const { return tolerance() <= largest_tolerance; }
  bool holds() const;
};

/// A curve for the report: measured points and the closed form through them.
struct VerificationCurve {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  std::vector<double> x = {};
  std::vector<double> measured = {};
  std::vector<double> expected = {};  // at x
};

struct VerificationOutcome {
  std::string check = {};
  VerificationKind kind = VerificationKind::blur;
  std::string camera = {};
  std::vector<VerificationResult> results = {};
  std::vector<VerificationCurve> curves = {};
  Image picture = {};        // the first that was taken, linear
  std::string failure = {};  // why there are no results, or fewer
  int pictures = 0;

  bool holds() const;
};

/// A finished picture of what `shot` asks for, linear R, G, B; by whatever way.
struct ChartShot {
  SimulationSpec shot = {};
  Scene scene = {};
};
using Photographer = std::function<Image(const ChartShot& shot)>;

/// Takes the check's pictures and measures them. What a picture refuses to tell, or a renderer
/// refuses to render, is the outcome's failure; Error{io_failure, cancelled} go on to the caller.
/// Throws: what `photographer` throws of those kinds.
VerificationOutcome verified(const VerificationCheck& check, const Photographer& photographer);

/// An error put into the shot that is sent, never into what is expected.
enum class PlantedError { focal_length, aperture, wavelength };
std::string_view planted_error_name(PlantedError error);

/// `shot` with the member multiplied by `factor`: f (a pinhole's image distance), the f-number (a
/// pinhole's diameter), the wavelength.
ChartShot with_planted(ChartShot shot, PlantedError error, double factor);

/// Whether a check of this kind can show that error at all.
bool can_show(const VerificationCheck& check, PlantedError error);

}  // namespace fstop
