#include "server/worker_scenes.h"

#include <algorithm>
#include <stdlib.h>
#include <system_error>
#include <variant>

#include "api/render_request.h"
#include "core/error.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFetched = 4;

fs::path temporary_folder() {
  std::string pattern = (fs::temp_directory_path() / "fstop-scenes-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr)
    throw Error(ErrorCode::io_failure, "cannot make the folder " + pattern);
  return pattern;
}

}  // namespace

WorkerScenes::WorkerScenes(const fs::path& folder, const api::Limits& limits)
    : limits_(limits), own_("", folder, limits), folder_(temporary_folder()) {}

WorkerScenes::~WorkerScenes() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

// Empty where it finds none.
std::string WorkerScenes::hash_in(CellScenes& scenes, const SweepCell& cell) const {
  try {
    return scenes.scene(api::parse_render_request(cell.request, limits_, scenes.names())).hash;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::io_failure) throw;
    return {};
  }
}

CellScenes* WorkerScenes::with(const SweepCell& cell, const api::CellOrder& order,
                               ContentStore& store) {
  if (order.scene.empty() || hash_in(own_.scenes, cell) == order.scene) return &own_.scenes;
  const auto is_it = [&](const std::unique_ptr<Kept>& kept) { return kept->hash == order.scene; };
  if (const auto found = std::ranges::find_if(fetched_, is_it); found != fetched_.end()) {
    fetched_.splice(fetched_.begin(), fetched_, found);
    return &fetched_.front()->scenes;
  }
  if (!fetch(cell, order, store)) return nullptr;
  auto kept = std::make_unique<Kept>(order.scene, folder_ / order.scene, limits_);
  if (hash_in(kept->scenes, cell) != order.scene) return nullptr;
  fetched_.push_front(std::move(kept));
  if (fetched_.size() > kFetched) {
    std::error_code ignored;
    fs::remove_all(folder_ / fetched_.back()->hash, ignored);
    fetched_.pop_back();
  }
  return &fetched_.front()->scenes;
}

// Whether all files of the order's scene lie in the folder of its hash, under the name that the
// cell calls it by.
bool WorkerScenes::fetch(const SweepCell& cell, const api::CellOrder& order, ContentStore& store) {
  const api::RenderRequest request =
      api::parse_render_request(cell.request, limits_, api::SceneNames::stored_only);
  const auto* name = std::get_if<std::string>(&request.scene);
  if (name == nullptr || order.scene_files.empty()) return false;
  const fs::path folder = folder_ / order.scene / *name;
  for (const api::CellFileRecord& file : order.scene_files) {
    const auto bytes = store.get(file.sha256);
    if (!bytes) return false;
    std::error_code ec;
    fs::create_directories((folder / file.name).parent_path(), ec);
    write_file((folder / file.name).string(), *bytes);
  }
  return true;
}

}  // namespace fstop::server
