#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/camera/camera_spec.h"
#include "core/camera/optical_summary.h"
#include "core/film/image.h"
#include "core/parallel.h"
#include "core/post/halftone.h"
#include "core/render/parts.h"
#include "core/sampling/patterns.h"
#include "core/scene/ray_scene.h"
#include "core/shading/illumination_choice.h"

namespace fstop {

enum class EffectChoice { automatic, on, off };

/// Which effects the full model has, and which must be modelled.
struct EffectChoices {
  EffectChoice defocus = EffectChoice::automatic;
  EffectChoice diffraction = EffectChoice::automatic;
  EffectChoice motion = EffectChoice::automatic;
  EffectChoice falloff = EffectChoice::off;
};

enum class Output {
  color,
  depth,
  coc,
  all_in_focus,
  variance,
  normal,
  distance,
  coc_diameter,
  valid,
  alpha
};

struct QualitySpec {
  double max_error = 0.01;  // RMSE against the full model, linear, values clipped to [0,1]
  std::optional<double> max_time_ms = {};
  std::string method = "auto";
  std::optional<int> samples = {};              // per pixel; overrides max_error
  PatternChoice sampling = {};                  // others than the default need `samples`
  std::optional<double> texture_width_px = {};  // of one lookup; absent: as max_error allows
  /// Of a blur disc's diameter, that a lookup averages over where that is wider; 0 to 0.5.
  double texture_disc_share = 0.0;
  std::int64_t most_samples = 2'000'000'000;  // over all pixels; max_error stops there, warned
};

/// One photograph as it is asked for, the scene apart.
struct SimulationSpec {
  CameraSpec camera = {};
  int width = 960;
  int height = 640;
  QualitySpec quality = {};
  EffectChoices effects = {};
  Illumination illumination = Illumination::recursive;
  std::vector<Output> outputs = {Output::color};
  std::uint32_t seed = 0;
  std::optional<HalftoneSpec> halftone = {};  // of files of 8 bits, made from the finished picture
};

/// An effect of the full model: in the image, or left out with what that changes at most.
struct ModelledEffect {
  std::string effect = {};
  bool modelled = false;
  double bound = 0.0;  // RMSE
  std::string why = {};
};
struct PassedOverMethod {
  std::string method = {};
  std::string why = {};
};
struct ImageError {
  double estimate = 0.0;  // RMSE
  double upper_95 = 0.0;
  double target = 0.0;
  double energy = 0.0;  // relative error of the total unclipped energy
  double energy_upper_95 = 0.0;
};
struct RenderCost {
  std::uint64_t rays = 0;
  double samples_mean = 0.0;
  int samples_max = 0;
};

/// What was done, how wrong it is and why it was done so. Holds no time: equal requests give
/// equal reports.
struct RenderReport {
  std::string method = {};
  std::vector<ModelledEffect> model = {};
  std::vector<PassedOverMethod> passed_over = {};
  ImageError error = {};
  std::optional<ImageError> alpha_error = {};  // of the layer alpha, where it was asked for
  OpticalSummary optics = {};
  RenderCost cost = {};
  std::vector<std::string> warnings = {};
};

/// The finished picture: colour (3 channels, linear) and the layers that were asked for:
/// depth (1: metres along the axis, infinity for background), coc (1: signed px), all_in_focus
/// (3), variance (3: expected square of the error by tiles of 16 x 16 pixels), normal (3: world,
/// unit, 0 for background), distance (1: metres along the pixel's centre ray, infinity for
/// background), coc_diameter (1: |coc| in um on the sensor), valid (1: 1 where the centre ray met a
/// surface, so that depth and blur are its own, else 0), alpha (1: the share of the pixel that
/// the scene covers, through pupil and shutter). With alpha the background is no part of colour:
/// black where it would be seen straight or through thin sheets, so that colour is premultiplied.
struct Photograph {
  Image color = {};
  std::map<Output, Image> layers = {};
  RenderReport report = {};
};

/// The method, effects and errors a request would get, without rendering it.
struct Plan {
  std::string method = {};
  std::vector<ModelledEffect> model = {};
  std::vector<PassedOverMethod> passed_over = {};
  std::vector<std::string> warnings = {};
};

/// Memory of the transforms that method `wave` takes: they are as much larger than the picture as
/// diffraction, `diffraction_px` = lambda N_w over the pixel pitch, reaches.
double transform_bytes(double diffraction_px, int width, int height);

/// The light path as one function: scene through camera onto film, with its error.
/// Same spec, scene and build: same photograph, whatever the threads and whoever traces parts of
/// it. `parts`: may be null; has the rounds of `color` and `all_in_focus` traced, of methods whose
/// pictures are made of parts and of requests that is_made_in_parts() tells of.
/// Throws: Error{outside_domain} for a camera that cannot be, Error{no_valid_method} where no
///         method models what must be modelled, Error{cancelled}, Error{over_budget}; what `parts`
///         throws.
Photograph simulate(const SimulationSpec& spec, const RayScene& scene, const RunControl& run,
                    PartTracer* parts = nullptr);

/// Whether simulate() would have parts of it traced: all but requests with max_time_ms, whose
/// samples follow from the time that they take, those for alpha, and methods that blur a finished
/// picture or spread waves. Throws: as simulate().
bool is_made_in_parts(const SimulationSpec& spec, const RayScene& scene, const RunControl& run);

/// A part of simulate()'s picture, for whoever makes the rest of it.
/// Throws: Error{invalid_request} for an order that is not of this picture, Error{cancelled}.
TracedPart traced_part(const SimulationSpec& spec, const RayScene& scene, const PartOrder& order,
                       const RunControl& run);

/// Plan without a scene's facts (null) or with them.
Plan plan_for(const SimulationSpec& spec, const RayScene* scene);

/// "depth", "coc", ... as requests name them; the inverse is empty for other words.
std::string_view output_name(Output output);
std::optional<Output> output_of(std::string_view name);

}  // namespace fstop
