#include "api/composite_request.h"

#include <algorithm>
#include <utility>

#include "api/base64.h"
#include "api/json_reader.h"
#include "api/json_text.h"
#include "api/render_id.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kFileBytes = 4096;
constexpr Range kKeyColors = {0.0, 1e6};
constexpr double kMostOffset = 1e6;  // pixels

constexpr Named<LayerKind> kKinds[] = {
    {"over", LayerKind::over}, {"overlay", LayerKind::overlay}, {"key", LayerKind::key}};
constexpr Named<ColorSpace> kColorSpaces[] = {{"srgb", ColorSpace::srgb},
                                              {"linear", ColorSpace::linear}};
constexpr Named<bool> kAlphas[] = {{"straight", false}, {"premultiplied", true}};
constexpr Named<ImageFormat> kFormats[] = {{"png", ImageFormat::png},
                                           {"jpeg", ImageFormat::jpeg},
                                           {"webp", ImageFormat::webp},
                                           {"tiff", ImageFormat::tiff},
                                           {"exr", ImageFormat::exr}};
constexpr Named<Precision> kPrecisions[] = {{"single", Precision::single},
                                            {"half", Precision::half}};
constexpr Named<bool> kOutputs[] = {{"color", false}, {"alpha", true}};

// A legal name within a stored scene: more is seen when it is opened.
bool is_stored_file(std::string_view name) {
  const std::size_t slash = name.find('/');
  return slash != std::string_view::npos && slash + 1 < name.size() &&
         is_scene_name(name.substr(0, slash));
}

LayerImage read_layer_image(ObjectReader& item, const Limits& limits, SceneNames names) {
  LayerImage picture;
  ObjectReader reader = item.object("image");
  if (reader.has("file") == reader.has("base64")) {
    reader.fault("must have one of file and base64");
    (void)reader.value("file", false);
    (void)reader.value("base64", false);
  } else if (reader.has("file")) {
    picture.file = reader.text("file", kFileBytes);
    const bool is_legal =
        names == SceneNames::stored_or_files ? !picture.file.empty() : is_stored_file(picture.file);
    if (reader.clean() && !is_legal) {
      reader.fault("file", "must name a stored scene's file, scene/file");
    }
  } else {
    const std::string text = reader.text("base64", limits.body_bytes);
    std::optional<std::string> bytes = base64_decoded(text);
    if (bytes && !bytes->empty()) {
      picture.bytes = std::move(*bytes);
      // What was sent is not repeated: its hash says which it was.
      reader.normalise("base64", "sha256:" + sha256_hex(std::string_view(picture.bytes)));
    } else if (reader.clean()) {
      reader.fault("base64", "must be a file's bytes in base64 (RFC 4648 4)");
    }
  }
  picture.color_space = reader.choice<ColorSpace>("color_space", kColorSpaces, "srgb");
  picture.is_premultiplied = reader.choice<bool>("alpha", kAlphas, "straight");
  reader.reject_unread_members();
  return picture;
}

// What is wrong with it stays wrong. Its format means nothing: a layer is no file.
json with_alpha(json request) {
  if (!request.contains("outputs")) request["outputs"] = json::array({"color"});
  json& outputs = request["outputs"];
  const bool is_list = outputs.is_array() && !outputs.empty();
  if (is_list && std::ranges::count(outputs, json("alpha")) == 0) outputs.push_back("alpha");
  const auto image = request.find("image");
  if (image != request.end() && image->is_object() && image->value("format", json()) == "jpeg") {
    image->erase("format");
  }
  return request;
}

// A request of its own, whose faults are told at its place here.
std::variant<std::string, RenderRequest, LayerImage> read_render(
    ObjectReader& item, bool needs_alpha, const Limits& limits, SceneNames names, FaultList& faults,
    std::optional<InvalidRequest>& too_much) {
  const json* member = item.value("render", true);
  if (member->is_string()) {
    std::string id = member->get<std::string>();
    if (!is_render_id(id)) item.fault("render", "must be a render's id, 64 hex digits");
    return id;
  }
  if (!member->is_object()) {
    item.fault("render", "must be a render's id or a render request, got " +
                             std::string(member->type_name()));
    return std::string();
  }
  const std::string pointer = item.pointer("render");
  try {
    const json asked = needs_alpha ? with_alpha(*member) : *member;
    RenderRequest request = parse_render_request(json_text(asked), limits, names);
    if (request.spec.quality.max_time_ms) {
      faults.add(pointer + "/quality/max_time_ms",
                 "must be absent in a layer: what it reaches depends on the moment");
    }
    if (request.spec.halftone) {
      faults.add(pointer + "/image/halftone", "must be absent in a layer");
    }
    item.normalise("render", json::parse(request.normalised));
    return request;
  } catch (const InvalidRequest& refused) {
    const InvalidRequest moved = moved_faults(refused, pointer);
    if (refused.code() == ErrorCode::over_budget) {
      too_much = moved;
    } else {
      for (const FieldFault& fault : moved.faults()) faults.add(fault.pointer, fault.detail);
    }
    return std::string();
  }
}

ChromaKey read_key(ObjectReader& item) {
  ObjectReader reader = item.object("key");
  ChromaKey key;
  const auto color = reader.triple("color", kKeyColors, "");
  for (std::size_t c = 0; c < 3; ++c) key.color[c] = static_cast<float>(color[c]);
  key.tolerance = reader.number("tolerance", {0.0, 1e6}, 0.1);
  key.softness = reader.number("softness", {0.0, 1e6}, 0.1);
  reader.reject_unread_members();
  return key;
}

std::optional<std::array<int, 2>> read_offset(ObjectReader& item) {
  if (!item.has("offset_px")) return std::nullopt;
  const json* member = item.value("offset_px", true);
  const auto is_whole = [](const json& number) {
    if (!number.is_number()) return false;
    const double value = number.get<double>();
    return value >= -kMostOffset && value <= kMostOffset &&
           value == static_cast<double>(static_cast<int>(value));
  };
  if (!member->is_array() || member->size() != 2 || !std::ranges::all_of(*member, is_whole)) {
    item.fault("offset_px", "must be two whole numbers of pixels from -1000000 to 1000000");
    return std::nullopt;
  }
  return std::array<int, 2>{static_cast<int>((*member)[0].get<double>()),
                            static_cast<int>((*member)[1].get<double>())};
}

CompositeLayer read_layer(ObjectReader& item, bool is_lowest, const Limits& limits,
                          SceneNames names, FaultList& faults,
                          std::optional<InvalidRequest>& too_much) {
  CompositeLayer layer;
  layer.kind = item.choice<LayerKind>("operation", kKinds, "over");
  if (layer.kind == LayerKind::key) {
    if (!item.has("key")) item.fault("key", "is required where operation is key");
    layer.key = read_key(item);
  } else if (item.has("key")) {
    item.fault("key", "needs operation to be key");
    (void)item.value("key", false);
  }
  layer.opacity = item.number("opacity", {0.0, 1.0}, 1.0);
  layer.offset = read_offset(item);
  if (item.has("render") == item.has("image")) {
    item.fault("must have one of render and image");
    (void)item.value("render", false);
    (void)item.value("image", false);
  } else if (item.has("image")) {
    layer.source = read_layer_image(item, limits, names);
  } else {
    const bool needs_alpha = layer.kind == LayerKind::over && !is_lowest;
    layer.source = read_render(item, needs_alpha, limits, names, faults, too_much);
  }
  item.reject_unread_members();
  return layer;
}

}  // namespace

CompositeRequest parse_composite_request(std::string_view body, const Limits& limits,
                                         SceneNames names) {
  const json value = parse_json(body, limits);
  FaultList faults(limits.faults);
  json normal;
  ObjectReader root(value, "#", faults, normal);
  faults.throw_if_any();
  CompositeRequest request;
  std::optional<InvalidRequest> too_much;
  for (ObjectReader& item : root.objects("layers", limits.composite_layers)) {
    request.layers.push_back(
        read_layer(item, request.layers.empty(), limits, names, faults, too_much));
  }
  const auto asked = value.find("layers");
  if (asked == value.end() || (asked->is_array() && asked->empty())) {
    root.fault("layers", "must be an array of 1 to " + std::to_string(limits.composite_layers));
  }
  const std::vector<bool> outputs = root.choices<bool>("outputs", kOutputs, "color");
  request.wants_alpha = std::ranges::count(outputs, true) > 0;
  ObjectReader image = root.object("image");
  request.format = image.choice<ImageFormat>("format", kFormats, "png");
  request.precision = image.choice<Precision>("precision", kPrecisions, "single");
  const bool is_float = request.format == ImageFormat::exr || request.format == ImageFormat::tiff;
  if (image.clean() && request.precision == Precision::half && !is_float) {
    image.fault("precision", "may be \"half\" only where format is exr or tiff");
  }
  if (image.clean() && request.wants_alpha && request.format == ImageFormat::jpeg) {
    image.fault("format", "cannot be jpeg where outputs have alpha: it holds none");
  }
  image.reject_unread_members();
  root.reject_unread_members();
  faults.throw_if_any();
  if (too_much) throw InvalidRequest(*too_much);
  request.normalised = json_text(normal);
  return request;
}

std::string layer_pointer(std::size_t layer) { return "#/layers/" + std::to_string(layer); }

InvalidRequest moved_faults(const InvalidRequest& refused, std::string_view pointer) {
  std::vector<FieldFault> faults;
  for (const FieldFault& fault : refused.faults()) {
    const bool has_place = fault.pointer.starts_with('#');
    faults.push_back({std::string(pointer) + (has_place ? fault.pointer.substr(1) : std::string()),
                      fault.detail});
  }
  return InvalidRequest(std::move(faults), refused.code());
}

}  // namespace fstop::api
