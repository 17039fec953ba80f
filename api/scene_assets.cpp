#include "api/scene_assets.h"

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "api/json_text.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "core/scene/mesh_placement.h"
#include "core/shading/ray_tree.h"

namespace fstop::api {
namespace {

/// Loads one asset after the other and remembers what it has seen.
class AssetLoader {
 public:
  AssetLoader(const AssetReader& read, std::string_view pointer, const Limits& limits)
      : read_(read), pointer_(pointer), limits_(limits), faults_(limits.faults) {}

  void load(Scene& scene) {
    for (TextureSource& texture : scene.textures) load_texture(texture);
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      auto* object = std::get_if<MeshObject>(&scene.objects[i].shape);
      if (object == nullptr) continue;
      load_mesh(*object, i);
      require_uv(scene, *object, i);
    }
    faults_.throw_if_any();
  }

  std::vector<AssetBytes> take_bytes() { return std::move(bytes_); }

 private:
  using TextureKey = std::pair<std::string, ColorSpace>;
  using MeshKey = std::pair<std::string, std::optional<double>>;  // file, crease angle

  void load_texture(TextureSource& texture) {
    const std::string where = pointer_ + "/textures/" + pointer_step(texture.name) + "/file";
    const TextureKey key{texture.file, texture.color_space};
    guarded(where, texture.file, [&] {
      const auto known = textures_.find(key);
      texture_pixels_ += known == textures_.end() ? 0 : pixels_of(known->second->image);
      require(texture_pixels_, limits_.scene_texture_pixels, "texture pixels");
      if (known != textures_.end()) {
        texture.image = known->second->image;
        return;
      }
      Scene alone;
      alone.textures.push_back(texture);
      load_assets(alone, reader(), limits_.assets);
      texture_pixels_ += pixels_of(alone.textures.front().image);
      require(texture_pixels_, limits_.scene_texture_pixels, "texture pixels");
      texture.image = std::move(alone.textures.front().image);
      textures_[key] = &texture;
    });
  }

  void load_mesh(MeshObject& object, std::size_t index) {
    const std::string where = pointer_ + "/objects/" + std::to_string(index) + "/file";
    guarded(where, object.file, [&] {
      const MeshKey key{object.file, object.crease_angle};
      const Mesh* known = known_mesh(key);
      if (known != nullptr) {
        triangles_ += known->triangles.size();
        require(triangles_, limits_.scene_triangles, "triangles");
        object.mesh = *known;
      } else {
        Scene alone;
        alone.objects.push_back({.shape = object});
        load_assets(alone, reader(), limits_.assets);
        object.mesh = std::move(std::get<MeshObject>(alone.objects.front().shape).mesh);
        triangles_ += object.mesh.triangles.size();
        require(triangles_, limits_.scene_triangles, "triangles");
      }
      if (object.placement) {
        if (known == nullptr) moved_.emplace(key, object.mesh);
        place(object.mesh, *object.placement);
      } else {
        meshes_.emplace(key, &object.mesh);
      }
    });
  }

  // A mesh as its file has it; null if it has not been read yet.
  const Mesh* known_mesh(const MeshKey& key) const {
    if (const auto there = meshes_.find(key); there != meshes_.end()) return there->second;
    const auto moved = moved_.find(key);
    return moved == moved_.end() ? nullptr : &moved->second;
  }

  // Relief has no direction on a mesh that has no texture coordinates of any kind.
  void require_uv(const Scene& scene, const MeshObject& mesh, std::size_t index) {
    const Object& object = scene.objects[index];
    const Material& material = scene.materials[static_cast<std::size_t>(object.material)];
    const bool has_relief = material.bump.texture >= 0 || material.normal_map.texture >= 0;
    const bool has_uv = !std::holds_alternative<OwnMapping>(object.mapping) ||
                        !mesh.mesh.uvs.empty() || mesh.mesh.positions.empty();
    if (!has_relief || has_uv) return;
    faults_.add(pointer_ + "/objects/" + std::to_string(index) + "/mapping",
                "is required: mesh " + mesh.file + " has no texture coordinates, which bump and " +
                    "normal_map of material " + material.name + " need");
  }

  // What is wrong with a file is a fault of the request; what is wrong with the disk is not.
  template <typename Load>
  void guarded(const std::string& where, const std::string& file, const Load& load) {
    if (const auto known = refused_.find(file); known != refused_.end()) {
      return faults_.add(where, known->second);
    }
    try {
      load();
    } catch (const Error& error) {
      if (error.code() == ErrorCode::io_failure || error.code() == ErrorCode::internal) throw;
      refused_[file] = shortened(error.what(), 2 * limits_.echo_bytes);
      faults_.add(where, refused_[file]);
    }
  }

  // Reads through `read_` once for each file, keeping the bytes for the hash.
  AssetReader reader() {
    return [this](const std::string& name) {
      for (const AssetBytes& asset : bytes_) {
        if (asset.name == name) return asset.bytes;
      }
      bytes_.push_back({.name = name, .bytes = read_(name)});
      file_bytes_ += bytes_.back().bytes.size();
      require(file_bytes_, limits_.scene_file_bytes, "bytes of files");
      return bytes_.back().bytes;
    };
  }

  static std::size_t pixels_of(const Image& image) {
    return static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  }

  static void require(std::size_t count, std::size_t most, const std::string& things) {
    if (count <= most) return;
    throw Error(ErrorCode::over_budget,
                "the scene has more than " + std::to_string(most) + " " + things + " in all");
  }

  const AssetReader& read_;
  std::string pointer_;
  const Limits& limits_;
  FaultList faults_;
  std::vector<AssetBytes> bytes_ = {};
  std::map<TextureKey, const TextureSource*> textures_ = {};
  std::map<MeshKey, const Mesh*> meshes_ = {};  // in the scene
  std::map<MeshKey, Mesh> moved_ = {};          // as they were before they were placed
  std::map<std::string, std::string> refused_ = {};
  std::size_t file_bytes_ = 0;
  std::size_t texture_pixels_ = 0;
  std::size_t triangles_ = 0;
};

}  // namespace

LoadedScene load_scene(SceneDocument document, const AssetReader& read, std::string_view pointer,
                       const Limits& limits) {
  AssetLoader loader(read, pointer, limits);
  loader.load(document.scene);
  LoadedScene loaded{.scene = std::move(document.scene)};
  loaded.rays_of_a_point = most_rays_of_a_point(loaded.scene);
  loaded.hash = scene_hash(document.canonical, loader.take_bytes());
  return loaded;
}

}  // namespace fstop::api
