#include "server/large_cells.h"

#include <optional>
#include <utility>

#include "api/render_request.h"
#include "core/error.h"
#include "server/cell_records.h"
#include "server/queue_parts.h"

namespace fstop::server {
namespace {

api::RenderRequest request_of(const SweepCell& cell, const CellTools& tools) {
  api::Limits limits = tools.limits;
  limits.body_bytes = limits.scene_bytes;  // a cell may bring its scene with it
  return api::parse_render_request(cell.request, limits, tools.scenes.names());
}

}  // namespace

bool LargeCells::is_large(const SweepCell& cell) const {
  if (!(services_.split_cpu_s > 0.0)) return false;
  try {
    const SimulationSpec spec = cell_spec(request_of(cell, services_.tools));
    return services_.costs.predict(spec, "").cpu_s > services_.split_cpu_s;
  } catch (const Error&) {
    return false;
  }
}

bool LargeCells::is_made_in_parts(const SweepCell& cell, const std::stop_token& stop) const {
  try {
    const api::RenderRequest request = request_of(cell, services_.tools);
    return fstop::is_made_in_parts(cell_spec(request), *services_.tools.scenes.scene(request).scene,
                                   {.stop = stop, .workers = &services_.tools.workers});
  } catch (const Error& error) {
    if (error.code() == ErrorCode::cancelled) throw;
    return false;
  }
}

void LargeCells::make(const SweepCell& cell, const api::CellOrder& order,
                      const std::function<void(CellOutcome)>& done, const WaitingFor& waiting,
                      const std::stop_token& stop) const {
  PatientStore store(services_.store, waiting, stop);
  PatientStore files(services_.files, waiting, stop);
  const std::string key = order_key(order);
  services_.log.event("cell_split", {{"cell", key}});
  std::optional<QueueParts> parts;
  CellOutcome outcome{.index = cell.index};
  try {
    const api::RenderRequest request = request_of(cell, services_.tools);
    const CellScenes::Ready ready = services_.tools.scenes.scene(request);
    if (!order.scene.empty() && order.scene != ready.hash)
      throw Error(ErrorCode::internal, "the scene of cell " + key + " was replaced meanwhile");
    api::CellOrder named = order;
    named.scene = ready.hash;
    parts.emplace(
        QueueParts::Services{.queue = services_.queue, .store = store, .log = services_.log},
        std::move(named));
    const Photograph photograph =
        simulate(cell_spec(request), *ready.scene,
                 {.stop = stop, .workers = &services_.tools.workers}, &*parts);
    outcome = finished_cell(cell, request, photograph, ready.hash, files);
  } catch (const PartFailed& failed) {
    outcome.problem = failed.what();
  } catch (const Error& error) {
    auto failed = failed_cell(cell, error);
    if (!failed) throw;
    outcome = *std::move(failed);
  }
  const int failed = outcome.problem.empty() ? 0 : 1;
  done(std::move(outcome));
  const auto traced = parts ? static_cast<int>(parts->traced()) : 0;
  if (parts) parts->tidy();
  services_.log.event("cell_joined", {{"cell", key}, {"parts", traced}, {"failed", failed}});
}

}  // namespace fstop::server
