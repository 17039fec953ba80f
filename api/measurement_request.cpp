#include "api/measurement_request.h"

#include <algorithm>

#include "api/base64.h"
#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/render_id.h"

namespace fstop::api {
namespace {

enum class Kind { sharpness, slanted_edge, disc_edge, spot, star };

constexpr Named<Kind> kKinds[] = {{"sharpness", Kind::sharpness},
                                  {"slanted-edge", Kind::slanted_edge},
                                  {"disc-edge", Kind::disc_edge},
                                  {"spot", Kind::spot},
                                  {"star", Kind::star}};
constexpr Named<MeasuredChannel> kChannels[] = {{"red", MeasuredChannel::red},
                                                {"green", MeasuredChannel::green},
                                                {"blue", MeasuredChannel::blue},
                                                {"luminance", MeasuredChannel::luminance}};
constexpr Named<ColorSpace> kColorSpaces[] = {{"srgb", ColorSpace::srgb},
                                              {"linear", ColorSpace::linear}};
constexpr Range kValues = {-1e6, 1e6};  // what a picture's samples may be expected to be
constexpr double kMostPixels = 16384.0;
constexpr std::size_t kMostNumbers = 64;

std::optional<PixelRegion> read_region(ObjectReader& item) {
  if (!item.has("region")) return std::nullopt;
  ObjectReader reader = item.object("region");
  const auto side = static_cast<std::int64_t>(kMostPixels);
  const auto pixels = [&](std::string_view key, std::int64_t min) {
    return static_cast<int>(reader.integer(key, min, side));
  };
  const PixelRegion region = {.x = pixels("x", 0),
                              .y = pixels("y", 0),
                              .width = pixels("width", 3),
                              .height = pixels("height", 3)};
  reader.reject_unread_members();
  return region;
}

EdgeQuestion read_edge(ObjectReader& item) {
  if (!item.has("levels")) return {};
  ObjectReader reader = item.object("levels");
  const EdgeLevels levels = {.dark = reader.number("dark", kValues),
                             .bright = reader.number("bright", kValues)};
  if (reader.clean() && levels.bright <= levels.dark) reader.fault("bright", "must exceed dark");
  reader.reject_unread_members();
  return {.levels = levels};
}

SpotQuestion read_spot(ObjectReader& item) {
  SpotSpec spec;
  spec.background = item.optional_number("background", kValues);
  spec.source_diameter = item.number("source_diameter_px", {0.0, kMostPixels}, 0.0);
  spec.blades = static_cast<int>(item.integer("blades", 0, 64, 0));
  if (item.clean() && (spec.blades == 1 || spec.blades == 2))
    item.fault("blades", "must be 0, or at least 3");
  spec.fractions = item.numbers("fractions", {0.001, 0.999}, kMostNumbers, {});
  return {.spec = std::move(spec)};
}

StarQuestion read_star(ObjectReader& item) {
  constexpr double kPi = 3.141592653589793;
  StarQuestion question;
  ObjectReader centre = item.object("center_px");
  question.star.centre = {centre.number("x", {0.0, kMostPixels}),
                          centre.number("y", {0.0, kMostPixels})};
  centre.reject_unread_members();
  question.star.cycles = static_cast<int>(item.integer("cycles", 2, 10'000));
  question.star.phase = item.number("phase_deg", {-360.0, 360.0}, 0.0) * kPi / 180.0;
  question.star.mean = item.number("mean", {1e-6, 1e6});
  question.star.amplitude = item.number("amplitude", {1e-6, 1e6});
  if (item.has("radii_px")) {
    question.radii = item.numbers("radii_px", {1.0, kMostPixels}, kMostNumbers, {});
  } else {
    item.fault("radii_px", "is required");
  }
  return question;
}

MeasurementQuestion read_question(ObjectReader& item) {
  MeasurementQuestion question;
  const bool has_kind = item.has("kind");
  const Kind kind = item.choice<Kind>("kind", kKinds);
  question.channel = item.choice<MeasuredChannel>("channel", kChannels, "luminance");
  // Of an unknown kind nobody knows the members.
  if (!has_kind || !item.clean()) return question;
  if (kind != Kind::star) question.region = read_region(item);
  switch (kind) {
    case Kind::sharpness:
      question.kind = SharpnessQuestion{};
      break;
    case Kind::slanted_edge:
      question.kind = read_edge(item);
      break;
    case Kind::disc_edge:
      question.kind = DiscEdgeQuestion{};
      break;
    case Kind::spot:
      question.kind = read_spot(item);
      break;
    case Kind::star:
      question.kind = read_star(item);
      break;
  }
  item.reject_unread_members();
  return question;
}

SentImage read_image(ObjectReader& root, const Limits& limits) {
  SentImage sent;
  ObjectReader reader = root.object("image");
  const std::string text = reader.text("base64", limits.body_bytes);
  sent.color_space = reader.choice<ColorSpace>("color_space", kColorSpaces, "srgb");
  if (reader.has("pixel_um")) sent.pixel_pitch = reader.length("pixel_um", 0.001_um, 1.0_m);
  std::optional<std::string> bytes = base64_decoded(text);
  if (!bytes || bytes->empty()) {
    if (reader.clean()) reader.fault("base64", "must be a file's bytes in base64 (RFC 4648 4)");
  } else {
    sent.bytes = std::move(*bytes);
  }
  reader.reject_unread_members();
  return sent;
}

}  // namespace

MeasurementRequest parse_measurement_request(std::string_view body, const Limits& limits) {
  const nlohmann::json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  nlohmann::json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  MeasurementRequest request;
  if (root.has("render") == root.has("image")) {
    root.fault("must have one of render and image");
    (void)root.value("render", false);
    (void)root.value("image", false);
  } else if (root.has("render")) {
    std::string id = root.text("render", 64);
    if (root.clean() && !is_render_id(id))
      root.fault("render", "must be a render's id, 64 hex digits");
    request.picture = std::move(id);
  } else {
    request.picture = read_image(root, limits);
  }
  for (ObjectReader& item : root.objects("measurements", limits.measurements)) {
    request.questions.push_back(read_question(item));
  }
  const auto asked = value.find("measurements");
  if (asked == value.end() || (asked->is_array() && asked->empty()))
    root.fault("measurements", "must be an array of 1 to " + std::to_string(limits.measurements));
  root.reject_unread_members();
  faults.throw_if_any();
  return request;
}

}  // namespace fstop::api
