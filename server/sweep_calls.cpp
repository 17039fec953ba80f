#include "server/sweep_calls.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <mutex>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <boost/asio/experimental/awaitable_operators.hpp>

#include "api/job_json.h"
#include "api/render_id.h"
#include "core/build_stop.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/counted.h"
#include "server/patient_store.h"
#include "server/reply_head.h"
#include "server/sweep_run.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
namespace fs = std::filesystem;

constexpr int kMostPreparing = 4;
constexpr const char* kRecipe = "recipe.json";
constexpr const char* kManifest = "manifest.json";
constexpr const char* kJobs = "jobs";
constexpr std::size_t kHashDigits = 64;

bool is_hash(std::string_view text) {
  return text.size() == kHashDigits && std::ranges::all_of(text, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

Refusal no_such(const char* what) {
  return {http::status::not_found, "not-found", std::string("there is no such ") + what};
}

std::optional<std::string> text_in(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string((std::istreambuf_iterator<char>(stream)), {});
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

// By its first bytes: a file is named by its hash alone.
std::string media_type_of(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG"sv)) return "image/png";
  if (bytes.starts_with("\xff\xd8\xff"sv)) return "image/jpeg";
  if (bytes.starts_with("RIFF"sv)) return "image/webp";
  if (bytes.starts_with("\x76\x2f\x31\x01"sv)) return "image/x-exr";
  if (bytes.starts_with("II*\0"sv)) return "image/tiff";
  return "application/octet-stream";
}

Reply json_reply(std::string text) {
  Reply reply{.body = std::move(text)};
  reply.set("Content-Type", "application/json");
  reply.set("Cache-Control", "no-store");
  return reply;
}

}  // namespace

/// A sweep that waits or runs.
struct SweepCalls::Active {
  std::size_t cells = 0;
  std::atomic<std::size_t> done = 0;
  std::atomic<bool> runs = false;

  void wait_for(std::string_view what) {
    const std::lock_guard lock(mutex_);
    waiting_ = what;
  }
  std::string waiting() const {
    const std::lock_guard lock(mutex_);
    return waiting_;
  }

 private:
  mutable std::mutex mutex_ = {};
  std::string waiting_ = {};
};

SweepCalls::SweepCalls(SweepServices services) : services_(std::move(services)) {
  if (!services_.folder.empty()) files_.emplace(services_.file_folder);
}

void SweepCalls::add_to(Routes& routes) {
  using Method = asio::awaitable<Reply> (SweepCalls::*)(Call&);
  const auto add = [&](http::verb verb, const char* pattern, Method method) {
    routes.add(verb, pattern, [this, method](Call& call) { return (this->*method)(call); });
  };
  add(http::verb::post, "/v1/sweeps", &SweepCalls::create);
  add(http::verb::get, "/v1/sweeps/{id}", &SweepCalls::show);
  add(http::verb::get, "/v1/sweeps/{id}/manifest", &SweepCalls::manifest);
  add(http::verb::get, "/v1/sweeps/{id}/files/{sha256}", &SweepCalls::file);
}

fs::path SweepCalls::folder_of(const std::string& id) const { return services_.folder / id; }

void SweepCalls::require_folder() const {
  if (!services_.folder.empty()) return;
  throw no_data_folder("sweeps");
}

asio::awaitable<Reply> SweepCalls::create(Call& call) {
  if (services_.draining) {
    throw Refusal(http::status::service_unavailable, "draining", "the server is about to stop")
        .with("Retry-After", "5");
  }
  if (preparing_ >= kMostPreparing) {
    throw Refusal(http::status::service_unavailable, "overloaded", "too many requests at once")
        .with("Retry-After", "1");
  }
  const Counted counted(preparing_);
  const Prepared prepared = co_await prepared_for(call);
  call.record.render = prepared.id;
  if (prepared.sweep->dry_run) {
    co_return json_reply(
        api::sweep_cost_json(prepared.id, prepared.sweep->cells.size(), prepared.cost));
  }
  if (prepared.is_done) {
    Reply reply = json_reply(view(prepared.id, nullptr));
    reply.set("Location", "/v1/sweeps/" + prepared.id);
    co_return reply;
  }
  services_.jobs.refuse_if_full();
  const std::shared_ptr<Job> job = start(prepared, call.client.peer(), {});
  // What was accepted outlives this process: the job's name before the client knows it.
  const fs::path note = folder_of(prepared.id) / kJobs / job->name;
  const auto write = [&note] {
    make_folder_durably(note.parent_path());
    write_durably(note.string(), "");
  };
  std::exception_ptr failure;
  try {
    co_await services_.readers.run(write);
  } catch (...) {
    failure = std::current_exception();
  }
  if (failure) {
    services_.jobs.withdraw(job);
    std::rethrow_exception(failure);
  }
  Reply reply = json_reply(api::job_json(view_of(*job)));
  reply.status = http::status::accepted;
  reply.set("Location", "/v1/jobs/" + job->name);
  reply.set("Retry-After", "1");
  co_return reply;
}

// Given up where the client goes.
asio::awaitable<SweepCalls::Prepared> SweepCalls::prepared_for(Call& call) {
  std::stop_source gone;
  Prepared prepared;
  std::exception_ptr failure;
  const auto expand = [&] {
    try {
      const BuildStop until(gone.get_token());
      prepared = prepare(call.request.body);
    } catch (...) {
      failure = std::current_exception();
    }
  };
  const auto watch = [](Connection& client, std::stop_source& stop) -> asio::awaitable<void> {
    co_await client.peer_gone();
    stop.request_stop();
  };
  // To its end, as its captures are this call's. And without cancelling: Boost 1.81 hands that to
  // the other thread, where it may come after the end of what it cancels.
  const auto to_its_end = [](Workers& expanders, const auto& work) -> asio::awaitable<void> {
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await expanders.run(work);
  };
  const auto first = co_await (to_its_end(services_.expanders, expand) || watch(call.client, gone));
  if (first.index() == 1) throw ClientGone();
  if (failure) std::rethrow_exception(failure);
  co_return prepared;
}

// On an expander: the sweep as it was asked for, kept where it is to be made.
SweepCalls::Prepared SweepCalls::prepare(const std::string& body) const {
  Prepared prepared;
  const auto sweep = std::make_shared<const api::SweepRequest>(
      api::parse_sweep_request(body, services_.limits, api::SceneNames::stored_only));
  if (!sweep->dry_run) require_folder();
  std::vector<std::string> hashes;
  for (const api::RenderRequest& scene : sweep->scenes) {
    try {
      hashes.push_back(services_.cells.scenes.hash(scene));
    } catch (const api::InvalidRequest& invalid) {
      throw api::in_sweep(invalid, *sweep);
    }
  }
  prepared.sweep = sweep;
  prepared.id = api::sweep_id(*sweep, hashes);
  prepared.cost = predicted_cost(services_.cells.costs, *sweep, hashes);
  if (sweep->dry_run) return prepared;
  prepared.is_done = fs::exists(folder_of(prepared.id) / kManifest);
  if (prepared.is_done) return prepared;
  refuse_what_costs_too_much(prepared);
  make_folder_durably(folder_of(prepared.id));
  if (const fs::path recipe = folder_of(prepared.id) / kRecipe; !fs::exists(recipe))
    write_durably(recipe.string(), sweep->recipe);
  return prepared;
}

void SweepCalls::refuse_what_costs_too_much(const Prepared& prepared) const {
  const auto most_s = std::chrono::duration<double>(services_.limits.sweep_time).count();
  const auto most_bytes = static_cast<double>(services_.limits.render_bytes);
  const auto refuse = [&](const std::string& detail) {
    throw Refusal(http::status::unprocessable_entity, "over-budget", detail)
        .predicting(prepared.cost);
  };
  if (prepared.cost.wall_s > most_s) {
    refuse("the sweep is predicted to take " + std::to_string(std::llround(prepared.cost.wall_s)) +
           " s, more than " + std::to_string(std::llround(most_s)) + " s");
  }
  if (prepared.cost.memory_bytes > most_bytes) {
    refuse("a render of the sweep is predicted to take " +
           std::to_string(std::llround(prepared.cost.memory_bytes / (1 << 20))) +
           " MiB, more than " + std::to_string(std::llround(most_bytes / (1 << 20))) + " MiB");
  }
}

// A job more that wants the sweep; its name is given where it had one before.
std::shared_ptr<Job> SweepCalls::start(const Prepared& prepared, const std::string& client,
                                       const std::string& name) {
  std::shared_ptr<Active> active = active_[prepared.id].lock();
  if (!active) {
    active = std::make_shared<Active>();
    active->cells = prepared.sweep->cells.size();
    active_[prepared.id] = active;
  }
  RenderQueue::Ticket ticket =
      services_.queue.submit({.id = prepared.id,
                              .client = client,
                              .cost_s = prepared.cost.wall_s,
                              .work = [this, prepared, active](const RenderQueue::Turn& turn) {
                                return run(prepared, active, turn);
                              }});
  return services_.jobs.add(
      {.render = prepared.id,
       .is_sweep = true,
       .name = name,
       .waiting_for = [active] { return active->waiting(); },
       .withdrawn = [note = folder_of(prepared.id) /
                            kJobs](const std::string& job) { ::unlink((note / job).c_str()); }},
      std::move(ticket));
}

// On the thread of the queue.
RenderQueue::Result SweepCalls::run(const Prepared& prepared, const std::shared_ptr<Active>& active,
                                    const RenderQueue::Turn& turn) {
  services_.log.event("sweep_start", {{"sweep", prepared.id}, {"queue_ms", turn.queued_ms}});
  active->runs = true;
  const WaitingFor waiting = [&](std::string_view what) {
    active->wait_for(what);
    turn.progress->changed();
    services_.log.event("sweep_waits", {{"sweep", prepared.id}, {"for", std::string(what)}});
  };
  try {
    std::optional<SweepRun> sweep;
    const auto open = [&] {
      sweep.emplace(*prepared.sweep, prepared.id, folder_of(prepared.id), *files_, false);
    };
    when_there_is_room(open, waiting, turn.stop);
    const auto maker = services_.maker ? services_.maker(*files_)
                                       : std::make_unique<QueueCellMaker>(
                                             services_.cells, "sweep " + prepared.id, *files_);
    const SweepRun::Summary summary = sweep->run(
        *maker,
        {.progress =
             [&](std::size_t done, std::size_t all) {
               active->done = done;
               turn.progress->advance(static_cast<double>(done) / static_cast<double>(all));
             },
         .waiting = waiting},
        turn.stop);
    std::error_code ignored;
    fs::remove_all(folder_of(prepared.id) / kJobs, ignored);
    services_.log.event("sweep", {{"sweep", prepared.id},
                                  {"cells", static_cast<int>(summary.cells)},
                                  {"kept", static_cast<int>(summary.kept)},
                                  {"failed", static_cast<int>(summary.failed)}});
    return active;
  } catch (const std::exception& exception) {
    services_.log.event("sweep_ended_early", {{"sweep", prepared.id}, {"why", exception.what()}});
    throw;
  }
}

asio::awaitable<void> SweepCalls::resume() {
  const auto look = [this] { return unfinished(); };
  for (const fs::path& folder : co_await services_.readers.run(look)) {
    try {
      const auto read = [this, &folder] { return prepare(text_in(folder / kRecipe).value_or("")); };
      const Prepared prepared = co_await services_.expanders.run(read);
      if (prepared.id != folder.filename()) {
        services_.log.warning("sweep_left", {{"sweep", folder.filename().string()},
                                             {"why", "its scenes or the engine have changed"}});
        continue;
      }
      for (const std::string& name : names_in(folder / kJobs)) start(prepared, "resumed", name);
    } catch (const std::exception& exception) {
      services_.log.warning("sweep_left",
                            {{"sweep", folder.filename().string()}, {"why", exception.what()}});
    }
  }
}

// Folders of sweeps that jobs want and that have no manifest.
std::vector<fs::path> SweepCalls::unfinished() const {
  std::vector<fs::path> folders;
  if (services_.folder.empty()) return folders;
  for (const std::string& name : names_in(services_.folder)) {
    const fs::path folder = services_.folder / name;
    if (is_hash(name) && !fs::exists(folder / kManifest) && !names_in(folder / kJobs).empty())
      folders.push_back(folder);
  }
  return folders;
}

std::string SweepCalls::view(const std::string& id, const std::shared_ptr<Active>& active) const {
  api::SweepView told{.sweep = id};
  told.is_done = fs::exists(folder_of(id) / kManifest);
  if (active && !told.is_done) {
    told.state = active->runs ? "running" : "queued";
    told.cells = active->cells;
    told.done = active->done;
    told.waiting_for = active->waiting();
    return api::sweep_json(told);
  }
  const SweepState state(folder_of(id) / "state.db");
  told.state = told.is_done ? "done" : "stopped";
  told.done = state.recorded().size();
  told.failed = state.failed();
  told.cells = told.done;
  if (const auto cells = state.fact("cells")) told.cells = std::stoull(*cells);
  return api::sweep_json(told);
}

asio::awaitable<Reply> SweepCalls::show(Call& call) {
  const std::string id = call.parameters[0];
  if (services_.folder.empty() || !is_hash(id)) throw no_such("sweep");
  const auto found = active_.find(id);
  const std::shared_ptr<Active> active = found == active_.end() ? nullptr : found->second.lock();
  const auto read = [this, &id, &active] {
    if (!active && !SweepRun::is_in(folder_of(id))) throw no_such("sweep");
    return view(id, active);
  };
  Reply reply = json_reply(co_await services_.readers.run(read));
  if (active) reply.set("Retry-After", "1");
  co_return reply;
}

asio::awaitable<Reply> SweepCalls::manifest(Call& call) {
  const std::string id = call.parameters[0];
  const auto read = [this, &id] {
    std::optional<std::string> text;
    if (!services_.folder.empty() && is_hash(id)) text = text_in(folder_of(id) / kManifest);
    if (!text) throw no_such("sweep, or it is not done");
    return std::pair(etag_of(api::sha256_hex(*text)), *std::move(text));
  };
  auto [tag, text] = co_await services_.readers.run(read);
  Reply reply = tagged_reply(call.request, "application/json", tag, std::move(text));
  reply.set("Cache-Control", "private, max-age=31536000, immutable");
  co_return reply;
}

asio::awaitable<Reply> SweepCalls::file(Call& call) {
  const std::string id = call.parameters[0];
  const std::string hash = call.parameters[1];
  const auto read = [this, &id, &hash] {
    std::optional<std::string> bytes;
    if (files_ && is_hash(id) && is_hash(hash) && fs::exists(folder_of(id)))
      bytes = files_->get(hash);
    if (!bytes) throw no_such("file");
    return *std::move(bytes);
  };
  std::string bytes = co_await services_.readers.run(read);
  std::string type = media_type_of(bytes);
  Reply reply = tagged_reply(call.request, std::move(type), etag_of(hash), std::move(bytes));
  reply.set("Cache-Control", "private, max-age=31536000, immutable");
  co_return reply;
}

}  // namespace fstop::server
