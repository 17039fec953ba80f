#include "server/cell_work.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <utility>
#include <variant>

#include "api/picture.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "api/report_json.h"
#include "core/error.h"
#include "server/patient_store.h"

namespace fstop::server {
namespace {

constexpr std::size_t kReadyScenes = 4;
constexpr int kLanes = 2;

std::string key_of(const api::RenderRequest& request) {
  if (const auto* name = std::get_if<std::string>(&request.scene)) return "name " + *name;
  return "scene " + std::get<api::SceneDocument>(request.scene).canonical;
}

bool wants_layers(const api::RenderRequest& request) {
  return request.format != ImageFormat::exr && request.spec.outputs.size() > 1;
}

CellFile put(ContentStore& store, std::string name, const Picture& picture, ImageFormat format,
             Precision precision) {
  const std::vector<std::byte> bytes = encode(picture, format, precision);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return {.name = std::move(name), .sha256 = store.put(text), .bytes = bytes.size()};
}

}  // namespace

CellScenes::Ready CellScenes::scene(const api::RenderRequest& request) {
  const std::string key = key_of(request);
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(entries_, key, &Entry::key);
  if (found != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, found);
    return found->ready;
  }
  api::LoadedScene loaded =
      folder_ ? api::load_beside(request, *folder_, store_, limits_) : store_.load(request);
  Ready ready{.hash = std::move(loaded.hash),
              .scene = std::make_shared<const RayScene>(std::move(loaded.scene))};
  entries_.push_front({key, ready});
  if (entries_.size() > kReadyScenes) entries_.pop_back();
  return ready;
}

SimulationSpec cell_spec(const api::RenderRequest& request) {
  SimulationSpec spec = request.spec;
  spec.outputs =
      api::layers_needed(wants_layers(request) ? ImageFormat::exr : request.format, spec.outputs);
  return spec;
}

CellOutcome finished_cell(const SweepCell& cell, const api::RenderRequest& request,
                          const Photograph& photograph, const std::string& scene_hash,
                          ContentStore& store) {
  const std::string id = api::render_id(request.canonical, scene_hash, api::engine_version());
  CellOutcome outcome{.index = cell.index, .render_id = id};
  const auto add = [&](const std::string& stem, ImageFormat format, Precision precision) {
    outcome.files.push_back(put(store, stem + "." + std::string(format_name(format)),
                                api::picture_of(photograph, request.spec, id, format), format,
                                precision));
  };
  add("image", request.format, request.precision);
  if (wants_layers(request)) add("layers", ImageFormat::exr, Precision::single);
  outcome.report = api::lasting_report_json(photograph.report, scene_hash);
  return outcome;
}

std::optional<CellOutcome> failed_cell(const SweepCell& cell, const std::exception& exception) {
  const auto* error = dynamic_cast<const Error*>(&exception);
  if (error == nullptr || error->code() == ErrorCode::cancelled ||
      error->code() == ErrorCode::io_failure) {
    return std::nullopt;
  }
  return CellOutcome{.index = cell.index, .problem = api::to_json(api::problem(exception))};
}

CellOutcome make_cell(const SweepCell& cell, const CellTools& tools, ContentStore& store,
                      std::stop_token stop) {
  try {
    const api::RenderRequest request =
        api::parse_render_request(cell.request, tools.limits, tools.scenes.names());
    const CellScenes::Ready ready = tools.scenes.scene(request);
    const Photograph photograph = simulate(cell_spec(request), *ready.scene,
                                           {.stop = std::move(stop), .workers = &tools.workers});
    return finished_cell(cell, request, photograph, ready.hash, store);
  } catch (const Error& error) {
    if (auto failed = failed_cell(cell, error)) return *std::move(failed);
    throw;
  }
}

CellOutcome make_part(const SweepCell& cell, std::string_view order, const CellTools& tools,
                      ContentStore& store, std::stop_token stop) {
  try {
    const api::RenderRequest request =
        api::parse_render_request(cell.request, tools.limits, tools.scenes.names());
    const CellScenes::Ready ready = tools.scenes.scene(request);
    const PartOrder part = part_order_of(order);
    const std::string bytes =
        bytes_of(traced_part(cell_spec(request), *ready.scene, part,
                             {.stop = std::move(stop), .workers = &tools.workers}),
                 part);
    return {.index = cell.index,
            .files = {{.name = "part.bin", .sha256 = store.put(bytes), .bytes = bytes.size()}}};
  } catch (const Error& error) {
    if (auto failed = failed_cell(cell, error)) return *std::move(failed);
    throw;
  }
}

void LocalCellMaker::make(const std::vector<SweepCell>& cells, const Listener& listener,
                          std::stop_token stop) {
  std::stop_source ended;  // by the caller, or by a lane that failed
  const std::stop_callback pass_on(stop, [&] { ended.request_stop(); });
  std::mutex telling;
  PatientStore store(
      store_,
      [&](std::string_view what) {
        const std::lock_guard lock(telling);
        listener.waiting(what);
      },
      ended.get_token());
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < cells.size() && !ended.stop_requested(); i = next++) {
        CellOutcome outcome = make_cell(cells[i], tools_, store, ended.get_token());
        const std::lock_guard lock(telling);
        listener.done(std::move(outcome));
      }
    } catch (const Error& error) {
      const std::lock_guard lock(telling);
      if (error.code() == ErrorCode::cancelled && ended.stop_requested()) return;
      if (!failure) failure = std::current_exception();
      ended.request_stop();
    } catch (...) {
      const std::lock_guard lock(telling);
      if (!failure) failure = std::current_exception();
      ended.request_stop();
    }
  };
  {
    std::vector<std::jthread> lanes;
    for (int i = 0; i < kLanes; ++i) lanes.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace fstop::server
