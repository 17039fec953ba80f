#include "server/scene_calls.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <stdlib.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "api/render_id.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/reply_head.h"
#include "server/sandbox.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;

constexpr int kUploadNiceness = 10;
constexpr const char* kIncoming = ".incoming-";

std::string tag_of(std::string_view text) { return etag_of(api::sha256_hex(text)); }

Reply json_reply(std::string text) {
  Reply reply{.body = std::move(text)};
  reply.set("Content-Type", "application/json");
  reply.set("Cache-Control", "no-store");
  return reply;
}

// A folder beside the scenes that goes away unless it has become one.
class Incoming {
 public:
  explicit Incoming(const fs::path& folder) {
    std::error_code ec;
    fs::create_directories(folder, ec);
    std::string pattern = (folder / (std::string(kIncoming) + "XXXXXX")).string();
    if (::mkdtemp(pattern.data()) == nullptr)
      throw Error(ErrorCode::io_failure, "cannot make " + pattern + ": " + std::strerror(errno));
    ::chmod(pattern.c_str(), 0755);
    path_ = pattern;
  }
  ~Incoming() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Incoming(const Incoming&) = delete;
  Incoming& operator=(const Incoming&) = delete;
  const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

}  // namespace

SceneCalls::SceneCalls(SceneServices services)
    : services_(std::move(services)), uploads_(1, kUploadNiceness) {
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(services_.folder, ec)) {
    std::error_code ignored;
    if (entry.path().filename().string().starts_with(kIncoming)) fs::remove_all(entry, ignored);
  }
}

void SceneCalls::add_to(Routes& routes) {
  using Method = asio::awaitable<Reply> (SceneCalls::*)(Call&);
  const auto add = [&](http::verb verb, const char* pattern, Method method) {
    routes.add(verb, pattern, [this, method](Call& call) { return (this->*method)(call); });
  };
  add(http::verb::get, "/v1/scenes", &SceneCalls::list);
  add(http::verb::get, "/v1/scenes/{name}", &SceneCalls::show);
  add(http::verb::put, "/v1/scenes/{name}", &SceneCalls::put);
}

asio::awaitable<Reply> SceneCalls::list(Call&) {
  const auto read = [this] { return api::scene_list_json(services_.store.list()); };
  co_return json_reply(co_await services_.readers.run(read));
}

asio::awaitable<Reply> SceneCalls::show(Call& call) {
  const auto read = [this, &call] {
    std::string text = services_.store.text(call.parameters[0]);
    const std::string tag = tag_of(text);
    Reply reply = tagged_reply(call.request, "application/json", tag, std::move(text));
    reply.set("Cache-Control", "no-cache");
    return reply;
  };
  co_return co_await services_.readers.run(read);
}

asio::awaitable<Reply> SceneCalls::put(Call& call) {
  if (services_.folder.empty()) throw no_data_folder("uploads of scenes");
  const auto work = [this, &call] { return keep(call.parameters[0], call.request); };
  co_return co_await uploads_.run(work);
}

Reply SceneCalls::keep(const std::string& name, const Request& request) {
  if (!api::is_scene_name(name)) {
    throw Refusal(http::status::unprocessable_entity, "bad-name",
                  "a scene's name has 1 to 64 of a-z, 0-9 and -");
  }
  if (services_.store.is_beside(services_.folder, name)) {
    throw Refusal(http::status::conflict, "bundled-scene",
                  "the server has a scene of its own called " + name +
                      ", which stays as it is: choose another name");
  }
  const api::UploadedScene scene = decoded(name, request.body);
  const bool is_new = store(name, scene);
  services_.log.event("scene_stored", {{"scene", name}, {"request", request.id}});
  Reply reply = json_reply(scene.reply);
  reply.status = is_new ? http::status::created : http::status::ok;
  reply.set("Location", "/v1/scenes/" + name);
  return reply;
}

// By a process of its own, locked in: what it says is as little to be trusted as what it read.
api::UploadedScene SceneCalls::decoded(const std::string& name, const std::string& body) {
  const SandboxLimits limits;
  const SandboxAnswer answer = run_apart(services_.program, {"read-scene", name}, body, limits);
  if (answer.exit_code == 0) return api::unpacked_upload(answer.output);
  if (answer.exit_code == 2) throw api::UploadRefused(api::problem_of_upload(answer.output));
  services_.log.warning("scene_reader_ended",
                        {{"exit_code", answer.exit_code}, {"timed_out", answer.timed_out ? 1 : 0}});
  throw Refusal(http::status::unprocessable_entity, "bad-scene",
                "the scene could not be read within " + std::to_string(limits.cpu_s) + " s and " +
                    std::to_string(limits.memory_bytes >> 20U) + " MiB");
}

// All of it or nothing, in one step. Whether there was none of this name. Renders that have begun
// hold what they read.
bool SceneCalls::store(const std::string& name, const api::UploadedScene& scene) {
  const Incoming incoming(services_.folder);
  for (const api::ArchiveEntry& file : scene.files) {
    const fs::path path = incoming.path() / file.name;
    std::error_code ec;
    fs::create_directories(path.parent_path(), ec);
    write_durably(path.string(),
                  {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()});
  }
  const fs::path place = services_.folder / name;
  if (::rename(incoming.path().c_str(), place.c_str()) == 0) return true;
  if (::renameat2(AT_FDCWD, incoming.path().c_str(), AT_FDCWD, place.c_str(), RENAME_EXCHANGE) == 0)
    return false;
  throw Error(ErrorCode::io_failure, "cannot store scene " + name + ": " + std::strerror(errno));
}

}  // namespace fstop::server
