#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/parallel.h"
#include "core/render/parts.h"
#include "core/render/simulation.h"

namespace fstop {

/// Who traces a picture's rounds elsewhere, and what that picture is called there.
struct PictureParts {
  PartTracer* tracer = nullptr;     // null: nobody
  std::string method = {};          // PartOrder::method
  std::uint32_t sharp_samples = 0;  // PartOrder::sharp_samples
};

/// A request made ready: what methods work on.
struct Shot {
  const RayScene* scene = nullptr;  // null only for planning
  CameraSpec camera = {};
  Sensor sensor = {};
  QualitySpec quality = {};
  EffectChoices effects = {};
  Illumination illumination = Illumination::recursive;
  std::uint32_t seed = 0;
  bool hides_background = false;  // as SampleSource
  bool wants_variance = false;    // the outcome's image of it is asked for
  double brightest = 0.0;         // ShotFacts::brightest, once the shot was probed
  PictureParts parts = {};
  /// Of methods that trace in parts: the outcome is this part of the picture, and nothing else.
  const PartOrder* part = nullptr;
  // max_time_ms counts from here.
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
};

/// What a cheap probe and closed forms say of a shot; what plans are made from.
struct ShotFacts {
  double pixel_count = 0.0;
  double largest_blur_px = 0.0;  // diameter of the largest geometric blur disc that was found
  double diffraction_q = 0.0;    // lambda N_w / pixel pitch
  double edge_share = 0.0;       // of the picture, by tiles, where an edge in depth may hide light
  double edge_length = 0.0;      // of such edges, in pixels, over the picture's pixels
  double edge_area = 0.0;        // of strips as wide as they hide light, likewise
  double blurred_share = 0.0;    // of the probe's points with blur discs over 6 px
  double contrast = 0.0;         // standard deviation of the picture's values, clipped to [0,1]
  int emitters_found = 0;        // small bright ones, in the scene
  double emitter_px = 0.0;       // pixels that their light fills, at most as bright as white
  int emitters_splatted = 0;     // of those, that the camera would splat
  bool moves = false;            // something moves while the shutter is open
  bool camera_moves = false;     // and it is the camera, whose motion is modelled
  bool mirrors = false;          // something reflects or transmits
  bool interreflects = false;    // diffuse surfaces light each other
  double branch_share = 0.0;     // of the picture that shows such things
  double mirror_share = 0.0;     // of the picture that shows mirrors, glass and sheets
  double branch_error = 0.0;     // what ends of reflected and transmitted paths change at most
  double brightest = 0.0;        // pixel value of the brightest that shines or was met, at least 1
  bool forks = false;            // one surface both reflects and transmits
  bool area_lights = false;
  bool carries_light = false;    // lamps light surfaces by mirrors and glass, and it is asked for
  bool averages_texels = false;  // lookups in some texture
  /// Tiles of kTile pixels a side, row by row: nonzero where all that the probe found in and around
  /// them is blurred over several pixels.
  std::vector<std::uint8_t> soft_tiles = {};
  std::uint64_t probe_rays = 0;
};

/// An effect a method leaves out, or models with an error: `transfer_loss` is the largest error of
/// the optical transfer function up to Nyquist, so that its RMSE is at most transfer_loss times the
/// picture's contrast.
struct EffectLoss {
  std::string effect = {};
  double transfer_loss = 0.0;
  std::string why = {};
  bool modelled = false;
  double offset = 0.0;     // RMSE beside it, whatever the contrast: light lost or gained evenly
  bool certified = false;  // the outcome's noise holds it already: told, not added

  double rmse(double contrast) const { return transfer_loss * contrast + offset; }
};

struct ErrorBound {
  double rmse = 0.0;                     // of all losses, against the full model
  std::vector<EffectLoss> effects = {};  // each with its share
};

struct Quote {
  std::string refusal = {};  // why the shot lies outside the domain; empty inside
  ErrorBound error = {};
  double cost_rays = 0.0;  // in traced rays, constants fixed: a plan never depends on the host
};

/// Why methods refuse shots whose samples follow a pattern.
inline constexpr const char* kSequenceAlone = "takes its samples from the default sequence alone";
/// Why methods that blur a finished picture leave scenes with ScreenMapping.
inline constexpr const char* kScreenMapsStay =
    "blurs a finished picture, and a texture that is fixed to the picture stays sharp";

/// Why methods that trace from the camera alone refuse such light.
inline constexpr const char* kCarriesNoLight =
    "carries no light from lamps by mirrors and glass, which illumination global asks for";

/// How samples were shared between pixels.
struct SharedSamples {
  int widest_window = 1;  // pixels along a side
  double bias = 0.0;      // RMSE that sharing adds, measured; part of the outcome's noise
};

/// The picture, what it took and how noisy it is.
struct RenderOutcome {
  Image color = {};     // 3 channels
  Image variance = {};  // 3 channels, of the mean; may be empty where the shot wants none
  double samples_mean = 0.0;
  int samples_max = 0;
  NoiseEstimate noise = {};
  std::uint64_t rays = 0;
  std::optional<double> cut_rmse = {};  // of branches not followed, measured
  std::optional<std::vector<EffectLoss>> effects =
      {};  // where rendering learnt more than the quote
  std::optional<SharedSamples> shared = {};
  /// Light that lamps send by mirrors and glass, carried forward (light_tracing.h): paths, and the
  /// root of its mean square in the picture, values clipped to [0,1].
  std::uint64_t carried_paths = 0;
  double carried_rms = 0.0;
  bool samples_pupil = false;    // its rays went through all of the pupil
  bool splats_emitters = false;  // small bright emitters were splatted, not left to samples
  TracedPart part = {};          // Shot::part
  std::vector<std::string> warnings = {};
};

/// One way to turn a shot into an image.
class RenderMethod {
 public:
  virtual ~RenderMethod() = default;
  virtual std::string_view name() const noexcept = 0;
  /// Whether the picture is made of samples that others may trace: Shot::parts and Shot::part.
  virtual bool traces_in_parts() const noexcept { return false; }
  virtual Quote quote(const Shot& shot, const ShotFacts& facts) const = 0;
  /// Renders until the noise, joined with `bias` (RMSE of what is left out), keeps the shot's
  /// quality. Same seed, same pixels, whatever the thread count. Throws: Error{cancelled}.
  virtual RenderOutcome render(const Shot& shot, const ShotFacts& facts, double bias,
                               const RunControl& run) const = 0;
};

/// All methods, cheapest kind first.
std::span<const RenderMethod* const> render_methods();

/// RMSE of `effects` in a picture of the given contrast.
double loss_rmse(std::span<const EffectLoss> effects, double contrast);

}  // namespace fstop
