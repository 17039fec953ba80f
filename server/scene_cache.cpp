#include "server/scene_cache.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "api/render_id.h"
#include "server/http_message.h"
#include "server/worker_messages.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

// Name, size and time of every file below `folder`.
std::string state_of(const fs::path& folder) {
  std::set<std::string> files;
  std::error_code ec;
  for (fs::recursive_directory_iterator entry(folder, ec), end; !ec && entry != end;
       entry.increment(ec)) {
    std::error_code gone;
    const auto time = entry->last_write_time(gone).time_since_epoch().count();
    const auto size = entry->is_regular_file(gone) ? entry->file_size(gone) : 0;
    files.insert(entry->path().string() + ' ' + std::to_string(size) + ' ' + std::to_string(time));
  }
  std::string state = folder.string();
  for (const std::string& file : files) state += '\n' + file;
  return state;
}

// The stored scenes whose files an inline scene uses: what stands before the first '/'.
std::set<std::string> scenes_used_by(const Scene& scene) {
  std::set<std::string> names;
  const auto add = [&](const std::string& file) { names.insert(file.substr(0, file.find('/'))); };
  for (const TextureSource& texture : scene.textures) add(texture.file);
  for (const Object& object : scene.objects) {
    if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) add(mesh->file);
  }
  return names;
}

}  // namespace

SceneCache::Source SceneCache::source_of(const api::RenderRequest& request) const {
  if (const auto* name = std::get_if<std::string>(&request.scene))
    return {"stored " + *name, state_of(store_.folder_of(*name))};
  const auto& document = std::get<api::SceneDocument>(request.scene);
  Source source{"inline " + api::sha256_hex(std::string_view(document.canonical)), {}};
  for (const std::string& name : scenes_used_by(document.scene))
    source.state += state_of(store_.folder_of(name)) + '\n';
  return source;
}

std::string SceneCache::hash(const api::RenderRequest& request) {
  const Source source = source_of(request);
  {
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      for (const Source& known : entry->sources) {
        if (known.key != source.key || known.state != source.state) continue;
        entries_.splice(entries_.begin(), entries_, entry);
        return entries_.front().hash;
      }
    }
  }
  api::LoadedScene loaded = store_.load(request);
  const std::string hash = loaded.hash;
  keep(std::move(loaded), source);
  return hash;
}

std::shared_ptr<const MemoryFile> SceneCache::keep(api::LoadedScene loaded, const Source& source) {
  auto shared = std::make_shared<const MemoryFile>(scene_file(loaded.scene));
  const std::lock_guard lock(mutex_);
  ++counts_.loaded;
  auto entry = find_hash(loaded.hash);
  if (entry == entries_.end()) {
    entries_.push_front({.hash = loaded.hash});
    entry = entries_.begin();
    entry->bytes = shared->size();
    entry->shared = std::move(shared);
    entry->rays_of_a_point = loaded.rays_of_a_point;
  }
  std::erase_if(entry->sources, [&](const Source& known) { return known.key == source.key; });
  entry->sources.push_back(source);
  entries_.splice(entries_.begin(), entries_, entry);
  evict();
  return entries_.front().shared;
}

double SceneCache::rays_of_a_point(const std::string& hash) {
  const std::lock_guard lock(mutex_);
  const auto entry = find_hash(hash);
  return entry == entries_.end() ? 1.0 : entry->rays_of_a_point;
}

std::shared_ptr<const MemoryFile> SceneCache::shared(const api::RenderRequest& request,
                                                     const std::string& hash) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto entry = find_hash(hash); entry != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, entry);
      return entries_.front().shared;
    }
  }
  // It gave way to others while the request waited.
  const Source source = source_of(request);
  api::LoadedScene loaded = store_.load(request);
  if (loaded.hash != hash) {
    throw Refusal(http::status::conflict, "scene-changed",
                  "the scene's files changed while the request waited");
  }
  return keep(std::move(loaded), source);
}

std::shared_ptr<const RayScene> SceneCache::scene(const api::RenderRequest& request,
                                                  const std::string& hash) {
  const std::shared_ptr<const MemoryFile> bytes = shared(request, hash);
  std::unique_lock lock(mutex_);
  auto entry = find_hash(hash);
  while (entry != entries_.end() && entry->building) {
    built_.wait(lock);
    entry = find_hash(hash);
  }
  if (entry == entries_.end()) {  // it gave way to others just now
    lock.unlock();
    return scene(request, hash);
  }
  if (entry->built) return entry->built;
  entry->building = true;  // and so not evicted
  lock.unlock();
  std::shared_ptr<const RayScene> built;
  try {
    built = std::make_shared<const RayScene>(scene_of(*bytes));
  } catch (...) {
    lock.lock();
    entry->building = false;
    built_.notify_all();
    throw;
  }
  lock.lock();
  ++counts_.built;
  entry->building = false;
  entry->built = built;
  entry->bytes = built->memory_bytes() + 2 * bytes->size();  // it holds its meshes, too
  built_.notify_all();
  evict();
  return built;
}

std::list<SceneCache::Entry>::iterator SceneCache::find_hash(const std::string& hash) {
  return std::find_if(entries_.begin(), entries_.end(),
                      [&](const Entry& entry) { return entry.hash == hash; });
}

void SceneCache::evict() {
  std::size_t total = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    total += entry->bytes;
    const bool is_newest = entry == entries_.begin();
    const bool stays = is_newest || entry->building || total <= max_bytes_;
    if (!stays) total -= entry->bytes;
    entry = stays ? std::next(entry) : entries_.erase(entry);
  }
}

SceneCache::Counts SceneCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace fstop::server
