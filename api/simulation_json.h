#pragma once

#include "api/json_reader.h"
#include "api/limits.h"
#include "core/encode/image_codec.h"
#include "core/render/simulation.h"

namespace fstop::api {

/// The image a request asks for.
struct ImageSpec {
  int width = 960;
  int height = 640;
  ImageFormat format = ImageFormat::png;
  Precision precision = Precision::single;
  std::optional<HalftoneSpec> halftone = {};
};

/// The members that render and optics requests share, each read from the object it stands in.
/// Absent they have the defaults of the contract; faults go to the reader's list.
CameraSpec read_camera(ObjectReader& camera);
ImageSpec read_image(ObjectReader& image, const Limits& limits);
QualitySpec read_quality(ObjectReader& quality, const Limits& limits);
EffectChoices read_effects(ObjectReader& effects);
/// The member "illumination" of a request.
Illumination read_illumination(ObjectReader& root);

/// Adds a fault to `image` unless its pixels are square on the camera's sensor.
void require_square_pixels(ObjectReader& image, const ImageSpec& size, const CameraSpec& camera);

}  // namespace fstop::api
