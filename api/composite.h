#pragma once

#include <optional>
#include <string>
#include <vector>

#include "api/composite_request.h"
#include "core/film/image.h"
#include "core/post/layer_stack.h"
#include "core/render/simulation.h"

namespace fstop::api {

/// A layer's picture, however it came about, with the errors that it has.
struct LayerPicture {
  Image color = {};  // 3 channels, linear
  Image alpha = {};  // 1 channel; empty: covers all
  bool is_premultiplied = true;
  LayerError error = {};
  std::string render = {};  // the id, of renders
};

/// The picture of a finished render.
LayerPicture layer_picture(const Photograph& photograph, std::string id);

/// The picture in a file, exact. Throws: Error{bad_image}.
LayerPicture layer_picture(const std::vector<std::byte>& bytes, const LayerImage& image,
                           const Limits& limits);

/// The same of pixels that were read before: 3 channels, or 4 with alpha.
LayerPicture layer_picture(const Image& pixels, bool is_premultiplied);

/// What a composite is.
struct Composite {
  Image color = {};  // 3 channels, as it stands before black
  Image alpha = {};  // 1 channel; empty where it was not asked for
  std::string report = {};
  LayerError error = {};
};

/// Puts the layers of a request onto each other, one after the other, so that no more than two
/// pictures are held.
class Compositor {
 public:
  /// `request` outlives the compositor.
  explicit Compositor(const CompositeRequest& request) : request_(request) {}

  /// The next layer's picture, the lowest first. Throws: InvalidRequest with the layer's pointer
  /// where it has another size than the lowest and no offset.
  void add(const LayerPicture& picture);

  /// Throws: Error{internal} before all layers were added.
  Composite finish(const std::string& id) const;

 private:
  struct Told {
    std::string render = {};
    int width = 0;
    int height = 0;
    LayerError error = {};  // of the layer as it is laid, keyed or not
    bool is_exact = true;
  };

  const CompositeRequest& request_;
  std::optional<LayerStack> stack_ = {};
  std::vector<Told> told_ = {};
};

/// The composite as one file, with alpha as picture_of() has it.
Picture composite_picture(const Composite& composite, const std::string& id, ImageFormat format);

/// The content hash of a composite: of its request and of what stands for each layer, a render's id
/// or a file's hash.
std::string composite_id(const CompositeRequest& request, const std::vector<std::string>& layers);

}  // namespace fstop::api
