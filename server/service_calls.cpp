// The server's probes and metrics: what the probes' thread answers, too. It reads only what any
// thread may.
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "api/render_id.h"
#include "server/docs_page.h"
#include "server/reply_head.h"
#include "server/server.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;

Reply text_reply(std::string type, std::string text) {
  Reply reply{.body = std::move(text)};
  reply.set("Content-Type", std::move(type));
  reply.set("Cache-Control", "no-store");
  return reply;
}

Handler immediate(std::function<Reply(const Call&)> answer) {
  return [answer = std::move(answer)](Call& call) -> asio::awaitable<Reply> {
    co_return answer(call);
  };
}

std::string gauge(std::string_view name, std::string_view help, double value) {
  return metric_lines(name, "gauge", help, value);
}

std::string counter(std::string_view name, std::string_view help, std::uint64_t value) {
  return metric_lines(name, "counter", help, static_cast<double>(value));
}

std::string queue_metrics(const RenderQueue::Counts& counts) {
  return gauge("fstop_renders_running", "Renders under way.", counts.running) +
         gauge("fstop_renders_queued", "Renders that wait.", counts.queued) +
         gauge("fstop_queue_age_seconds", "How long the oldest of them has waited.",
               counts.oldest_s) +
         gauge("fstop_queue_backlog_seconds", "Until all is done, at the measured pace.",
               counts.backlog_s) +
         counter("fstop_renders_started_total", "Renders begun.", counts.started) +
         counter("fstop_renders_joined_total", "Requests that shared a render of another.",
                 counts.joined) +
         counter("fstop_renders_withdrawn_total", "Renders nobody waited for any more.",
                 counts.withdrawn) +
         counter("fstop_renders_refused_total", "Requests that found the queue full.",
                 counts.refused);
}

std::string worker_metrics(const WorkerCrew::Counts& counts) {
  return gauge("fstop_workers", "Processes that render.", counts.workers) +
         gauge("fstop_workers_resident_memory_bytes", "Of them all.",
               static_cast<double>(counts.resident_bytes)) +
         counter("fstop_worker_deaths_total", "Such processes that ended unasked.", counts.deaths) +
         counter("fstop_workers_stopped_total", "Ended as they did not stop when told to.",
                 counts.stopped) +
         counter("fstop_scene_builds_total", "Scenes that they built.", counts.builds);
}

}  // namespace

void Server::add_probes(Routes& routes) {
  routes.add(http::verb::get, "/livez", immediate([](const Call&) {
               return text_reply("application/json", R"({"status":"alive"})");
             }));
  routes.add(http::verb::get, "/readyz", immediate([this](const Call&) {
               if (!draining_) return text_reply("application/json", R"({"status":"ready"})");
               Reply reply = problem_reply(503, "draining", "the server is about to stop");
               reply.set("Retry-After", "5");
               return reply;
             }));
  routes.add(http::verb::get, "/metrics", immediate([this](const Call&) {
               return text_reply("text/plain; version=0.0.4; charset=utf-8", metrics_text());
             }));
}

// The page's own policy: scripts and styles from here, nothing in its text.
void Server::add_docs() {
  struct Part {
    const char* path = nullptr;
    const char* type = nullptr;
    std::string_view text = {};
  };
  for (const Part& part : {Part{"/docs", "text/html; charset=utf-8", docs_page()},
                           {"/docs/docs.css", "text/css; charset=utf-8", docs_style()},
                           {"/docs/docs.js", "text/javascript; charset=utf-8", docs_script()}}) {
    const std::string tag = etag_of(api::sha256_hex(part.text));
    routes_.add(http::verb::get, part.path, immediate([part, tag](const Call& call) {
                  Reply reply = tagged_reply(call.request, part.type, tag, std::string(part.text));
                  reply.set("Content-Security-Policy",
                            "default-src 'none'; script-src 'self'; style-src 'self'; "
                            "connect-src 'self'; base-uri 'none'; frame-ancestors 'none'");
                  reply.set("Referrer-Policy", "no-referrer");
                  reply.set("Cache-Control", "no-cache");
                  return reply;
                }));
  }
}

std::string Server::metrics_text() const {
  const RenderCache::Counts memory = renders_.counts();
  const ResultStore::Counts files = files_of_renders_.counts();
  return metrics_.text() + queue_metrics(queue_.counts()) + worker_metrics(worker_counts()) +
         counter("fstop_cache_hits_total", "Results found finished.", memory.hits) +
         counter("fstop_cache_misses_total", "Results that had to be made.", memory.misses) +
         gauge("fstop_cache_memory_bytes", "Of results in memory.",
               static_cast<double>(memory.bytes)) +
         gauge("fstop_cache_file_bytes", "Of results in files.", static_cast<double>(files.bytes)) +
         gauge("fstop_cache_files", "Files of results.", static_cast<double>(files.files)) +
         counter("fstop_cache_file_loads_total", "Results read from files.", files.loaded) +
         counter("fstop_cache_evicted_total", "Files that gave way to others.", files.evicted) +
         counter("fstop_cache_damaged_total", "Files that were not whole.", files.damaged) +
         gauge("fstop_jobs_active", "Jobs under way.", jobs_.active()) +
         gauge("fstop_connections", "Open connections.", listener_.sessions()) +
         gauge("fstop_draining", "1 once the server is about to stop.", draining_ ? 1.0 : 0.0) +
         gauge("fstop_threads", "That render.", pool_.threads()) + process_metrics();
}

}  // namespace fstop::server
