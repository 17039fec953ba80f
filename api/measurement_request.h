#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/limits.h"
#include "core/film/image.h"
#include "core/measure/sharpness.h"
#include "core/measure/slanted_edge.h"
#include "core/measure/spot.h"
#include "core/measure/star_contrast.h"
#include "core/scene/scene.h"
#include "core/units.h"

namespace fstop::api {

/// What of a picture's linear colours is measured: one channel, or the luminance of Rec. 709.
enum class MeasuredChannel { red, green, blue, luminance };

struct SharpnessQuestion {};
struct EdgeQuestion {
  std::optional<EdgeLevels> levels = {};
};
struct DiscEdgeQuestion {};
struct SpotQuestion {
  SpotSpec spec = {};
};
struct StarQuestion {
  SinusoidalStar star = {};
  std::vector<double> radii = {};  // px
};

/// One thing to measure in a picture.
struct MeasurementQuestion {
  std::optional<PixelRegion> region = {};  // absent: all of the picture
  MeasuredChannel channel = MeasuredChannel::luminance;
  std::variant<SharpnessQuestion, EdgeQuestion, DiscEdgeQuestion, SpotQuestion, StarQuestion> kind =
      {};
};

/// A picture that was sent: a file that nobody has looked into yet.
struct SentImage {
  std::string bytes = {};
  ColorSpace color_space = ColorSpace::srgb;
  std::optional<Length> pixel_pitch = {};
};

/// A request for measurements: every value checked that can be without the picture.
struct MeasurementRequest {
  std::variant<std::string, SentImage> picture = {};  // a finished render's id, or a file
  std::vector<MeasurementQuestion> questions = {};
};

/// Reads {"render" or "image", "measurements"}. Throws: InvalidRequest with every fault.
MeasurementRequest parse_measurement_request(std::string_view body, const Limits& limits);

/// Width, height, pixel pitch where it is known, and one answer for each question, as JSON text.
/// `image`: linear RGB. Throws: InvalidRequest{outside_domain} with the pointer of every question
///         that the picture has no answer to, and why; {over_budget} for too many pixels.
std::string measurement_json(const MeasurementRequest& request, ImageView<const float> image,
                             std::optional<Length> pixel_pitch, const Limits& limits);

/// The picture in a file that was sent, linear RGB: PNG, JPEG or EXR.
/// Meant for a process that can do no harm: it works on foreign bytes.
/// Throws: Error{bad_image}.
Image read_sent_image(std::string_view bytes, ColorSpace color_space, const Limits& limits);

/// The same with its alpha as a fourth channel, where the file has one: colours as they are stored.
Image read_sent_layer(std::string_view bytes, ColorSpace color_space, const Limits& limits);

/// A picture as bytes, and back: how it leaves the process that read it.
std::string packed_image(const Image& image);
/// Throws: Error{internal} for what is no such text.
Image unpacked_image(std::string_view text, const Limits& limits);

}  // namespace fstop::api
