#include "api/composite.h"

#include <algorithm>
#include <span>
#include <utility>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/picture.h"
#include "api/render_id.h"
#include "core/error.h"
#include "core/scene/scene_file.h"

namespace fstop::api {
namespace {

constexpr double kChanceOfEach = 0.05;  // that a layer's bound does not hold

// Alpha of a key and of the picture's own: what either takes out is out.
Image keyed_layer(const Image& layer, const ChromaKey& key) {
  Image result = keyed(color_of(layer), key);
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x) {
      float& alpha = result.at(x, y)[3];
      alpha = std::min(alpha, layer.at(x, y)[3]);
    }
  }
  return result;
}

Image channels_of(const LayerPicture& picture) {
  return picture.alpha.empty() ? opaque_layer(picture.color)
                               : layer_of(picture.color, picture.alpha, picture.is_premultiplied);
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height) + " pixels";
}

Json error_json(const LayerError& error) {
  return {{"color", number_json(error.color)}, {"alpha", number_json(error.alpha)}};
}

}  // namespace

LayerPicture layer_picture(const Photograph& photograph, std::string id) {
  LayerPicture picture{.color = photograph.color, .render = std::move(id)};
  const RenderReport& report = photograph.report;
  picture.error.color = report.error.upper_95;
  if (const auto alpha = photograph.layers.find(Output::alpha); alpha != photograph.layers.end()) {
    picture.alpha = alpha->second;
    picture.error.alpha = report.alpha_error ? report.alpha_error->upper_95 : 1.0;
  }
  return picture;
}

LayerPicture layer_picture(const std::vector<std::byte>& bytes, const LayerImage& image,
                           const Limits& limits) {
  const AssetLimits& assets = limits.assets;
  LayerPicture picture{.is_premultiplied = image.is_premultiplied};
  picture.color = decode_texture("the image", bytes, image.color_space, assets);
  picture.alpha = decode_alpha("the image", bytes, assets);
  return picture;
}

LayerPicture layer_picture(const Image& pixels, bool is_premultiplied) {
  if (pixels.channels() == 3) return {.color = pixels};
  LayerPicture picture{.is_premultiplied = is_premultiplied};
  picture.color = color_of(pixels);
  picture.alpha = alpha_of(pixels);
  return picture;
}

void Compositor::add(const LayerPicture& picture) {
  const std::size_t number = told_.size();
  const CompositeLayer& layer = request_.layers.at(number);
  const int width = picture.color.width();
  const int height = picture.color.height();
  if (!stack_) stack_.emplace(width, height);
  const Image& canvas = stack_->layer();
  if (!layer.offset && (width != canvas.width() || height != canvas.height())) {
    throw InvalidRequest(FieldFault{layer_pointer(number),
                                    "has " + size_text(width, height) + ", the lowest layer " +
                                        size_text(canvas.width(), canvas.height()) +
                                        ": needs offset_px to be laid upon it"});
  }
  Image channels = channels_of(picture);
  LayerError error = picture.error;
  const bool is_exact = error.color == 0.0 && error.alpha == 0.0;
  if (layer.kind == LayerKind::key) {
    const LayerError by_key = keyed_error(layer.key, channels, error.color);
    channels = keyed_layer(channels, layer.key);
    error = {.color = by_key.color, .alpha = std::max(by_key.alpha, error.alpha)};
  }
  const auto [left, top] = layer.offset.value_or(std::array<int, 2>{0, 0});
  stack_->add(channels, error,
              {.operation = layer.kind == LayerKind::overlay ? LayerOperation::overlay
                                                             : LayerOperation::over,
               .opacity = layer.opacity,
               .left = left,
               .top = top});
  told_.push_back({picture.render, width, height, error, is_exact});
}

Composite Compositor::finish(const std::string& id) const {
  if (!stack_ || told_.size() != request_.layers.size()) {
    throw Error(ErrorCode::internal, "a composite without all its layers");
  }
  Composite composite{.color = color_of(stack_->layer()), .error = stack_->error()};
  if (request_.wants_alpha) composite.alpha = alpha_of(stack_->layer());
  Json layers = Json::array();
  int uncertain = 0;
  bool overlays_a_render = false;
  for (std::size_t i = 0; i < told_.size(); ++i) {
    const Told& told = told_[i];
    Json item = {{"width", told.width}, {"height", told.height}};
    if (!told.render.empty()) item["render"] = told.render;
    item["error_upper"] = error_json(told.error);
    layers.push_back(std::move(item));
    if (told.is_exact) continue;
    ++uncertain;
    overlays_a_render = overlays_a_render || request_.layers[i].kind == LayerKind::overlay;
  }
  Json warnings = Json::array();
  if (stack_->unsure_share() > 0.0) {
    warnings.push_back(
        "pixels that are brighter than white where they are scaled, or lie on the "
        "fringe of an overlay, are counted as wholly wrong");
  }
  if (overlays_a_render) {
    warnings.push_back(
        "overlay decides by pixels that are exactly 0: light fainter than one "
        "sample shows, farther out than one pixel, is not in the bound");
  }
  const double confidence = std::max(0.0, 1.0 - kChanceOfEach * uncertain);
  const Json report = {{"id", id},
                       {"width", stack_->layer().width()},
                       {"height", stack_->layer().height()},
                       {"error",
                        {{"upper", number_json(composite.error.color)},
                         {"alpha_upper", number_json(composite.error.alpha)},
                         {"confidence", number_json(confidence)}}},
                       {"layers", std::move(layers)},
                       {"warnings", std::move(warnings)},
                       {"request", Json::parse(request_.normalised)}};
  composite.report = json_text(report);
  return composite;
}

Picture composite_picture(const Composite& composite, const std::string& id, ImageFormat format) {
  Picture picture = color_picture(composite.color, composite.alpha, format);
  picture.attributes = {{"fstop:engine", std::string(engine_version())}, {"fstop:requestHash", id}};
  return picture;
}

std::string composite_id(const CompositeRequest& request, const std::vector<std::string>& layers) {
  std::string text = request.normalised;
  for (const std::string& layer : layers) text += '\n' + layer;
  return render_id(text, "composite", engine_version());
}

}  // namespace fstop::api
