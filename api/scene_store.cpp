#include "api/scene_store.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <span>
#include <system_error>
#include <variant>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/problem.h"

namespace fstop::api {
namespace {

namespace fs = std::filesystem;

std::string file_text(const fs::path& path, const std::string& called, std::size_t most) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    throw Error(ErrorCode::not_found, "there is no " + called);
  }
  std::ifstream file(path, std::ios::binary);
  std::string text(most + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (file.fail() && !file.eof())) {
    throw Error(ErrorCode::io_failure, "reading " + path.string() + " failed");
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > most) {
    throw Error(ErrorCode::over_budget,
                called + " has more than " + std::to_string(most) + " bytes");
  }
  return text;
}

// The faults of a scene that a request only names all belong to that name.
LoadedScene load_named(const std::string& called, const fs::path& file, const Limits& limits) {
  try {
    SceneDocument document = parse_scene_text(file_text(file, called, limits.scene_bytes), limits);
    return load_scene(std::move(document), folder_assets(file.parent_path(), limits.assets), "#",
                      limits);
  } catch (const InvalidRequest& invalid) {
    std::vector<FieldFault> faults;
    for (const FieldFault& fault : invalid.faults()) {
      faults.push_back({"#/scene", called + ", " + fault.pointer + ": " + fault.detail});
    }
    throw InvalidRequest(std::move(faults), invalid.code(), invalid.unlisted());
  } catch (const Error& error) {
    if (error.code() == ErrorCode::io_failure || error.code() == ErrorCode::internal) throw;
    throw InvalidRequest(FieldFault{"#/scene", error.what()});
  }
}

std::set<std::string> asset_names(const Scene& scene) {
  std::set<std::string> names;
  for (const TextureSource& texture : scene.textures) names.insert(texture.file);
  for (const Object& object : scene.objects) {
    if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) names.insert(mesh->file);
  }
  return names;
}

SceneSummary summary_of(const SceneStore& store, const std::string& name, const Limits& limits) {
  try {
    const Scene scene = parse_scene_text(store.text(name), limits).scene;
    return {.name = name,
            .title = scene.title.empty() ? name : scene.title,
            .description = scene.description};
  } catch (const Error& error) {
    return {.name = name,
            .title = name,
            .description = "Cannot be used: " + shortened(error.what(), limits.echo_bytes)};
  }
}

}  // namespace

SceneStore::SceneStore(std::vector<fs::path> folders, const Limits& limits)
    : folders_(std::move(folders)), limits_(limits) {}

fs::path SceneStore::folder_of(std::string_view name) const {
  if (!is_scene_name(name)) return {};
  for (const fs::path& folder : folders_) {
    std::error_code ignored;
    if (fs::is_regular_file(folder / name / "scene.json", ignored)) return folder / name;
  }
  return {};
}

bool SceneStore::is_beside(const fs::path& folder, std::string_view name) const {
  return std::ranges::any_of(folders_, [&](const fs::path& other) {
    std::error_code ignored;
    return other != folder && fs::is_regular_file(other / name / "scene.json", ignored);
  });
}

std::vector<SceneSummary> SceneStore::list() const {
  std::map<std::string, SceneSummary> scenes;
  for (const fs::path& folder : folders_) {
    std::error_code absent;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, absent)) {
      const std::string name = entry.path().filename().string();
      if (!scenes.contains(name) && !folder_of(name).empty()) {
        scenes.emplace(name, summary_of(*this, name, limits_));
      }
    }
  }
  std::vector<SceneSummary> sorted;
  for (auto& [name, summary] : scenes) sorted.push_back(std::move(summary));
  return sorted;
}

std::string SceneStore::text(std::string_view name) const {
  const fs::path folder = folder_of(name);
  const std::string called = "stored scene " + shortened(name, 64);
  if (folder.empty()) throw Error(ErrorCode::not_found, "there is no " + called);
  return file_text(folder / "scene.json", called, limits_.scene_bytes);
}

std::vector<AssetBytes> SceneStore::files(std::string_view name) const {
  const std::string scene_text = text(name);
  const auto bytes = std::as_bytes(std::span(scene_text));
  std::vector<AssetBytes> files = {{"scene.json", {bytes.begin(), bytes.end()}}};
  const SceneDocument document = parse_scene_text(scene_text, limits_);
  const AssetReader read = folder_assets(folder_of(name), limits_.assets);
  std::size_t total = scene_text.size();
  for (const std::string& asset : asset_names(document.scene)) {
    files.push_back({asset, read(asset)});
    total += files.back().bytes.size();
    if (total > limits_.scene_file_bytes) {
      throw Error(ErrorCode::over_budget, "the scene has more than " +
                                              std::to_string(limits_.scene_file_bytes) +
                                              " bytes of files in all");
    }
  }
  return files;
}

std::vector<std::byte> SceneStore::file(const std::string& name) const {
  const std::size_t slash = name.find('/');
  const fs::path folder = folder_of(std::string_view(name).substr(0, slash));
  if (slash == std::string::npos || folder.empty()) {
    throw Error(ErrorCode::not_found, "must name a stored scene's file, scene/file; there is no " +
                                          shortened(name, limits_.echo_bytes));
  }
  return folder_assets(folder, limits_.assets)(name.substr(slash + 1));
}

LoadedScene SceneStore::load(const RenderRequest& request) const {
  if (const auto* name = std::get_if<std::string>(&request.scene)) {
    const fs::path folder = folder_of(*name);
    const std::string called = "stored scene " + shortened(*name, 64);
    if (folder.empty()) throw InvalidRequest(FieldFault{"#/scene", "there is no " + called});
    return load_named(called, folder / "scene.json", limits_);
  }
  const AssetReader read = [this](const std::string& name) { return file(name); };
  return load_scene(std::get<SceneDocument>(request.scene), read, "#/scene", limits_);
}

LoadedScene load_beside(const RenderRequest& request, const fs::path& request_folder,
                        const SceneStore& store, const Limits& limits) {
  const auto* name = std::get_if<std::string>(&request.scene);
  if (name == nullptr) {
    return load_scene(std::get<SceneDocument>(request.scene),
                      folder_assets(request_folder, limits.assets), "#/scene", limits);
  }
  if (!names_a_file(*name)) return store.load(request);
  return load_named("scene file " + shortened(*name, limits.echo_bytes), request_folder / *name,
                    limits);
}

std::string scene_list_json(const std::vector<SceneSummary>& scenes) {
  Json list = Json::array();
  for (const SceneSummary& scene : scenes) {
    list.push_back(
        {{"name", scene.name}, {"title", scene.title}, {"description", scene.description}});
  }
  return json_text(Json{{"scenes", std::move(list)}});
}

}  // namespace fstop::api
