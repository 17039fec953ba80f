#include "server/remote_cells.h"

#include <optional>
#include <utility>

#include "server/config.h"
#include "server/nats_cell_maker.h"
#include "server/patient_store.h"

namespace fstop::server {

// What the queue says, the listener tells.
RemoteCells::RemoteCells(const RemotePlace& place, ContentFolder& files,
                         const api::SceneStore& scenes, const Splitting& splitting)
    : files_(files),
      splitting_(splitting),
      log_("/dev/null"),
      store_(place.results,
             place.token_file.empty() ? "" : secret_of(place.token_file, "--token-file")),
      queue_({.url = place.queue, .name = "fstop sweep"}, log_),
      scenes_(scenes, splitting.tools.limits, store_) {}

void RemoteCells::make(const std::vector<SweepCell>& cells, const Listener& listener,
                       std::stop_token stop) {
  const auto fetched = [&](const CellFile& file) {
    if (files_.has(file)) return true;
    const std::optional<std::string> bytes = store_.get(file.sha256);
    if (!bytes) return false;
    when_there_is_room([&] { files_.put(*bytes); }, listener.waiting, stop);
    return true;
  };
  const LargeCells large({.queue = queue_,
                          .store = store_,
                          .files = files_,
                          .log = log_,
                          .tools = splitting_.tools,
                          .costs = splitting_.costs,
                          .split_cpu_s = splitting_.cpu_s});
  NatsCellMaker({.queue = queue_,
                 .store = store_,
                 .log = log_,
                 .is_kept = fetched,
                 .scene_of = [this](const SweepCell& cell) { return scenes_.of(cell); },
                 .large = &large})
      .make(cells, listener, std::move(stop));
}

void ServedCells::make(const std::vector<SweepCell>& cells, const Listener& listener,
                       std::stop_token stop) {
  // Scenes may be replaced between sweeps.
  SceneOrders scenes(services_.scenes, services_.limits, services_.files);
  CellScenes ready(services_.scenes, services_.limits);
  const LargeCells large(
      {.queue = services_.queue,
       .store = services_.files,
       .files = services_.files,
       .log = services_.log,
       .tools = {.limits = services_.limits, .scenes = ready, .workers = services_.workers},
       .costs = services_.costs,
       .split_cpu_s = services_.split_cpu_s});
  NatsCellMaker({.queue = services_.queue,
                 .store = services_.files,
                 .log = services_.log,
                 .is_kept = [this](const CellFile& file) { return services_.files.has(file); },
                 .scene_of = [&](const SweepCell& cell) { return scenes.of(cell); },
                 .leaves_cells = [this] { return services_.draining.load(); },
                 .large = &large})
      .make(cells, listener, std::move(stop));
}

}  // namespace fstop::server
