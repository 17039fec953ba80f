#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/limits.h"
#include "api/render_request.h"
#include "core/encode/image_codec.h"
#include "core/post/composite.h"
#include "core/scene/scene.h"

namespace fstop::api {

/// A picture for a layer: a file's bytes, or the name of one ("scene/file" of a stored scene; on
/// the command line also a path beside the request).
struct LayerImage {
  std::string file = {};   // empty: `bytes`
  std::string bytes = {};  // PNG, JPEG or EXR
  ColorSpace color_space = ColorSpace::srgb;
  bool is_premultiplied = false;
};

enum class LayerKind { over, overlay, key };

struct CompositeLayer {
  /// A finished render's id, a render to be made, or a picture.
  std::variant<std::string, RenderRequest, LayerImage> source = {};
  LayerKind kind = LayerKind::over;
  ChromaKey key = {};
  double opacity = 1.0;
  std::optional<std::array<int, 2>> offset = {};  // pixels, right and down
};

/// Layers to be put onto each other, the lowest first: every value checked that can be without the
/// pictures.
struct CompositeRequest {
  std::vector<CompositeLayer> layers = {};
  ImageFormat format = ImageFormat::png;
  Precision precision = Precision::single;
  bool wants_alpha = false;
  /// With all defaults filled: for the report.
  std::string normalised = {};
};

/// Reads {"layers", "image", "outputs"}. Renders above the lowest layer that are laid `over` get
/// the output alpha, asked for or not. Throws: InvalidRequest with every fault, over_budget where
/// too much work is asked for alone.
CompositeRequest parse_composite_request(std::string_view body, const Limits& limits,
                                         SceneNames names);

/// "#/layers/2"
std::string layer_pointer(std::size_t layer);

/// The faults of a request that stands at `pointer` of a larger one, as faults of that.
InvalidRequest moved_faults(const InvalidRequest& refused, std::string_view pointer);

}  // namespace fstop::api
