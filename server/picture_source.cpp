#include "server/picture_source.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include "api/reply_json.h"
#include "api/scene_store.h"
#include "core/error.h"
#include "core/parallel.h"
#include "server/config.h"
#include "server/http_client.h"

namespace fstop::server {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kPatience = 600s;
constexpr const char* kExr = "image/x-exr";

std::chrono::milliseconds retry_after(const ClientReply& reply) {
  const std::string text = reply.header("retry-after");
  int seconds = 1;
  std::from_chars(text.data(), text.data() + text.size(), seconds);
  return std::chrono::seconds(std::clamp(seconds, 1, 60));
}

/// The pictures of a server.
class ServerPictures {
 public:
  ServerPictures(const std::string& url, std::string token) : client_(url, std::move(token)) {}

  Image picture(std::string_view request) {
    const auto deadline = Clock::now() + kPatience;
    ClientReply reply = patiently("POST", "/v1/renders", request, deadline);
    if (reply.status == 202) reply = finished_job(reply, deadline);
    if (reply.status != 200) fail(reply);
    const std::string& body = reply.body;
    return api::finished_picture({reinterpret_cast<const std::byte*>(body.data()), body.size()},
                                 api::command_line_limits());
  }

 private:
  [[noreturn]] void fail(const ClientReply& reply) const {
    const std::string told = "the server " + client_.url() + " answers " +
                             std::to_string(reply.status) + ": " + api::told_problem(reply.body);
    if (reply.status == 401 || reply.status == 403)
      throw Error(ErrorCode::io_failure, told + " (its token is given by --token-file)");
    const bool is_refusal = reply.status >= 400 && reply.status < 500 && reply.status != 404;
    throw Error(is_refusal ? ErrorCode::unsupported : ErrorCode::io_failure, told);
  }

  // Asks again while the server is full.
  ClientReply patiently(std::string_view method, const std::string& target, std::string_view body,
                        Clock::time_point deadline) {
    for (;;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          std::max(deadline - Clock::now(), Clock::duration(1s)));
      ClientReply reply =
          client_.ask(method, target, {{"Accept", kExr}, {"Prefer", "wait=30"}}, body, left);
      const bool is_busy = reply.status == 429 || reply.status == 503;
      if (!is_busy || Clock::now() + retry_after(reply) > deadline) return reply;
      std::this_thread::sleep_for(retry_after(reply));
    }
  }

  ClientReply finished_job(const ClientReply& accepted, Clock::time_point deadline) {
    const std::string job = accepted.header("location");
    if (!job.starts_with("/v1/jobs/"))
      throw Error(ErrorCode::io_failure,
                  "the server " + client_.url() + " answers 202 without the Location of a job");
    while (Clock::now() < deadline) {
      const ClientReply reply = client_.ask("GET", job);
      if (reply.status != 200) fail(reply);
      const api::ToldJob told = api::told_job(reply.body);
      if (told.state == "done") return patiently("GET", job + "/image?format=exr", {}, deadline);
      if (told.state != "queued" && told.state != "running") {
        throw Error(ErrorCode::unsupported, "the server " + client_.url() +
                                                " says that the render is " + told.state + ": " +
                                                told.problem);
      }
      std::this_thread::sleep_for(100ms);
    }
    throw Error(ErrorCode::io_failure,
                "the server " + client_.url() + " has not rendered " + job + " in ten minutes");
  }

  HttpClient client_;
};

/// The pictures of this program.
class OwnPictures {
 public:
  explicit OwnPictures(const PictureSourceOptions& options)
      : limits_(api::command_line_limits()),
        store_({options.scenes_dir.empty() ? bundled_scenes()
                                           : std::filesystem::path(options.scenes_dir)},
               limits_),
        pool_(options.threads) {}

  Image picture(std::string_view request, const std::string& folder) {
    return api::picture_here(request, folder, store_, limits_, {.workers = &pool_});
  }

 private:
  api::Limits limits_;
  api::SceneStore store_;
  WorkerPool pool_;
};

}  // namespace

PictureSource picture_source(const PictureSourceOptions& options) {
  if (options.server.empty()) {
    return [own = std::make_shared<OwnPictures>(options)](std::string_view request,
                                                          const std::string& folder) {
      return own->picture(request, folder);
    };
  }
  const std::string token =
      options.token_file.empty() ? std::string() : secret_of(options.token_file, "--token-file");
  return [there = std::make_shared<ServerPictures>(options.server, token)](
             std::string_view request, const std::string&) { return there->picture(request); };
}

std::string source_name(const PictureSourceOptions& options) {
  return options.server.empty() ? "this program" : options.server;
}

}  // namespace fstop::server
