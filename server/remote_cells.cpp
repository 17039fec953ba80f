#include "server/remote_cells.h"

#include <optional>
#include <utility>
#include <variant>

#include "api/render_request.h"
#include "server/config.h"
#include "server/nats_cell_maker.h"
#include "server/patient_store.h"

namespace fstop::server {

std::string SceneHashes::of(const SweepCell& cell) {
  const api::RenderRequest request =
      api::parse_render_request(cell.request, limits_, scenes_.names());
  const auto* name = std::get_if<std::string>(&request.scene);
  if (name == nullptr) return {};
  const std::lock_guard lock(mutex_);
  auto known = by_name_.find(*name);
  if (known == by_name_.end()) known = by_name_.emplace(*name, scenes_.scene(request).hash).first;
  return known->second;
}

// What the queue says, the listener tells.
RemoteCells::RemoteCells(const RemotePlace& place, ContentFolder& files, CellScenes& scenes,
                         const api::Limits& limits)
    : files_(files),
      hashes_(scenes, limits),
      log_("/dev/null"),
      store_(place.results,
             place.token_file.empty() ? "" : secret_of(place.token_file, "--token-file")),
      queue_({.url = place.queue, .name = "fstop sweep"}, log_) {}

void RemoteCells::make(const std::vector<SweepCell>& cells, const Listener& listener,
                       std::stop_token stop) {
  const auto fetched = [&](const CellFile& file) {
    if (files_.has(file)) return true;
    const std::optional<std::string> bytes = store_.get(file.sha256);
    if (!bytes) return false;
    when_there_is_room([&] { files_.put(*bytes); }, listener.waiting, stop);
    return true;
  };
  NatsCellMaker({.queue = queue_,
                 .store = store_,
                 .log = log_,
                 .is_kept = fetched,
                 .scene_hash = [this](const SweepCell& cell) { return hashes_.of(cell); }})
      .make(cells, listener, std::move(stop));
}

}  // namespace fstop::server
