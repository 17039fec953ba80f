#include <filesystem>
#include <string>
#include <utility>
#include <variant>

#include "api/composite.h"
#include "api/picture.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "api/scene_store.h"
#include "core/error.h"
#include "core/parallel.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

/// Makes the pictures of a request's layers in this process.
class LayerMaker {
 public:
  LayerMaker(const CompositeOptions& options, const api::Limits& limits)
      : limits_(limits),
        folder_(options.request == "-" ? fs::path(".")
                                       : fs::absolute(options.request).parent_path()),
        store_({options.scenes_dir.empty() ? bundled_scenes() : fs::path(options.scenes_dir)},
               limits),
        pool_(options.threads) {}

  api::LayerPicture picture(const api::CompositeLayer& layer, const std::string& pointer) {
    try {
      if (const auto* render = std::get_if<api::RenderRequest>(&layer.source)) {
        return rendered(*render);
      }
      if (const auto* image = std::get_if<api::LayerImage>(&layer.source)) return read(*image);
    } catch (const api::InvalidRequest& refused) {
      throw api::InvalidRequest(api::moved_faults(refused, pointer + "/render"));
    } catch (const Error& error) {
      throw api::InvalidRequest(api::FieldFault{pointer, error.what()}, error.code());
    }
    throw api::InvalidRequest(api::FieldFault{
        pointer + "/render", "must be a render request here: ids belong to a server"});
  }

  const std::vector<std::string>& contents() const { return contents_; }

 private:
  api::LayerPicture rendered(const api::RenderRequest& request) {
    api::LoadedScene loaded = api::load_beside(request, folder_, store_, limits_);
    std::string id = api::render_id(request.canonical, loaded.hash, api::engine_version());
    contents_.push_back(id);
    const RayScene scene(std::move(loaded.scene));
    SimulationSpec spec = request.spec;
    spec.outputs = api::layers_needed(ImageFormat::png, spec.outputs);
    return api::layer_picture(simulate(spec, scene, {.workers = &pool_}), std::move(id));
  }

  api::LayerPicture read(const api::LayerImage& image) {
    if (image.file.empty()) {
      const auto* data = reinterpret_cast<const std::byte*>(image.bytes.data());
      contents_.emplace_back();
      return api::layer_picture({data, data + image.bytes.size()}, image, limits_);
    }
    const std::vector<std::byte> bytes = file(image.file);
    contents_.push_back(api::sha256_hex(bytes));
    return api::layer_picture(bytes, image, limits_);
  }

  // Beside the request; what is not there may be scene/file of a stored scene, as over HTTP.
  std::vector<std::byte> file(const std::string& name) const {
    std::error_code ignored;
    const bool is_stored = !store_.folder_of(name.substr(0, name.find('/'))).empty();
    if (is_stored && !fs::exists(folder_ / name, ignored)) return store_.file(name);
    return folder_assets(folder_, limits_.assets)(name);
  }

  const api::Limits& limits_;
  fs::path folder_;
  api::SceneStore store_;
  WorkerPool pool_;
  std::vector<std::string> contents_ = {};
};

}  // namespace

int composite(const CompositeOptions& options) {
  const api::Limits limits = api::command_line_limits();
  const auto request = api::parse_composite_request(text_of(options.request, limits.body_bytes),
                                                    limits, api::SceneNames::stored_or_files);
  const ImageFormat format = format_of_name(options.out).value_or(request.format);
  if (request.wants_alpha && format == ImageFormat::jpeg) {
    throw Error(ErrorCode::unsupported, "jpeg holds no alpha: --out must end in another suffix");
  }
  LayerMaker maker(options, limits);
  api::Compositor compositor(request);
  for (std::size_t i = 0; i < request.layers.size(); ++i) {
    compositor.add(maker.picture(request.layers[i], api::layer_pointer(i)));
  }
  const std::string id = api::composite_id(request, maker.contents());
  const api::Composite made = compositor.finish(id);
  write_image(options.out,
              encode(api::composite_picture(made, id, format), format, request.precision));
  if (options.report.empty()) {
    print_line(made.report);
  } else {
    write_file(options.report, made.report + "\n");
  }
  return 0;
}

}  // namespace fstop::server
