#include "server/metrics.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <malloc.h>
#include <system_error>
#include <unistd.h>

namespace fstop::server {
namespace {

std::string digits(double value) {
  std::array<char, 40> text = {};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string head(std::string_view name, std::string_view type, std::string_view help) {
  std::string text = "# HELP ";
  text.append(name).append(" ").append(help).append("\n# TYPE ").append(name).append(" ");
  return text.append(type).append("\n");
}

// Label values are ours but for methods and routes' patterns, which hold neither \ nor quotes;
// still nothing may break a line.
std::string label(std::string_view name, std::string_view value) {
  std::string text(name);
  text += "=\"";
  for (const char c : value) {
    const bool is_plain = c >= 0x20 && c < 0x7F && c != '"' && c != '\\';
    text += is_plain ? c : '_';
  }
  return text + '"';
}

std::string sample(std::string_view name, const std::string& labels, double value) {
  std::string text(name);
  if (!labels.empty()) text += "{" + labels + "}";
  return text + " " + digits(value) + "\n";
}

template <typename Histogram, typename Bounds>
std::string histogram(std::string_view name, std::string_view help, const Histogram& values,
                      const Bounds& bounds) {
  std::string text = head(name, "histogram", help);
  const std::string bucket = std::string(name) + "_bucket";
  double count = 0.0;
  for (std::size_t i = 0; i < values.counts.size(); ++i) {
    count += static_cast<double>(values.counts[i]);
    text += sample(bucket, label("le", i < bounds.size() ? digits(bounds[i]) : "+Inf"), count);
  }
  text += sample(std::string(name) + "_sum", {}, values.sum);
  return text + sample(std::string(name) + "_count", {}, count);
}

}  // namespace

template <std::size_t kBounds>
void Metrics::Histogram<kBounds>::add(double value, const std::array<double, kBounds>& bounds) {
  const auto at = std::lower_bound(bounds.begin(), bounds.end(), value) - bounds.begin();
  ++counts[static_cast<std::size_t>(at)];
  sum += value;
}

void Metrics::request(std::string_view route, std::string_view method, int status,
                      std::string_view problem, double seconds) {
  // Methods come from outside: only those we know name a series.
  constexpr std::array<std::string_view, 6> kMethods = {"GET", "HEAD",   "POST",
                                                        "PUT", "DELETE", "OPTIONS"};
  const bool is_known = std::find(kMethods.begin(), kMethods.end(), method) != kMethods.end();
  std::string call(is_known ? method : "other");
  call.append(" ").append(route.empty() ? "none" : route);
  const std::lock_guard lock(mutex_);
  ++requests_[{std::move(call), status}];
  if (!problem.empty()) ++problems_[std::string(problem)];
  request_seconds_.add(seconds, kSeconds);
}

void Metrics::render(std::string_view method, std::uint64_t rays, double predicted_s,
                     double actual_s) {
  const std::lock_guard lock(mutex_);
  ++renders_[std::string(method)];
  rays_ += rays;
  predicted_s_ += predicted_s;
  actual_s_ += actual_s;
  if (actual_s > 0.0) cost_ratio_.add(predicted_s / actual_s, kRatios);
}

std::string Metrics::text() const {
  const std::lock_guard lock(mutex_);
  std::string text = head("fstop_requests_total", "counter", "Requests by call and status.");
  for (const auto& [key, count] : requests_) {
    const std::size_t blank = key.first.find(' ');
    text += sample("fstop_requests_total",
                   label("method", key.first.substr(0, blank)) + "," +
                       label("route", key.first.substr(blank + 1)) + "," +
                       label("status", std::to_string(key.second)),
                   static_cast<double>(count));
  }
  text += head("fstop_errors_total", "counter", "Problems by type.");
  for (const auto& [slug, count] : problems_)
    text += sample("fstop_errors_total", label("type", slug), static_cast<double>(count));
  text += histogram("fstop_request_seconds",
                    "From the first byte of a request to the last one of its reply.",
                    request_seconds_, kSeconds);
  text += head("fstop_renders_total", "counter", "Finished renders by method.");
  for (const auto& [method, count] : renders_)
    text += sample("fstop_renders_total", label("method", method), static_cast<double>(count));
  text +=
      metric_lines("fstop_renders_failed_total", "counter", "Renders that failed or were stopped.",
                   static_cast<double>(failed_renders_.load()));
  text += metric_lines("fstop_rays_total", "counter",
                       "Rays of finished renders; its rate is rays per second.",
                       static_cast<double>(rays_));
  text += metric_lines("fstop_cost_predicted_seconds_total", "counter",
                       "Processor time predicted for finished renders.", predicted_s_);
  text += metric_lines("fstop_cost_actual_seconds_total", "counter",
                       "Processor time that finished renders took.", actual_s_);
  text += histogram("fstop_cost_ratio", "Predicted over actual processor time of each render.",
                    cost_ratio_, kRatios);
  return text + metric_lines("fstop_previews_total", "counter", "Previews of unfinished renders.",
                             static_cast<double>(previews_.load()));
}

std::string metric_lines(std::string_view name, std::string_view type, std::string_view help,
                         double value) {
  return head(name, type, help) + sample(name, {}, value);
}

std::string process_metrics() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0.0;
  double resident_pages = 0.0;
  statm >> total_pages >> resident_pages;
  std::timespec cpu = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  std::error_code ec;
  const auto descriptors = std::distance(std::filesystem::directory_iterator("/proc/self/fd", ec),
                                         std::filesystem::directory_iterator());
  const struct mallinfo2 heap = ::mallinfo2();
  return metric_lines("process_resident_memory_bytes", "gauge", "Resident memory.",
                      resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE))) +
         metric_lines("fstop_heap_in_use_bytes", "gauge",
                      "Memory that this process has asked for and not given back.",
                      static_cast<double>(heap.uordblks + heap.hblkhd)) +
         metric_lines("process_cpu_seconds_total", "counter", "Processor time of all threads.",
                      static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec)) +
         metric_lines("process_open_fds", "gauge", "Open file descriptors.",
                      static_cast<double>(descriptors));
}

}  // namespace fstop::server
