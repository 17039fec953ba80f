#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace fstop::server {

/// Counts what the server does, for any thread, and writes it as Prometheus reads it.
class Metrics {
 public:
  /// Bounds of durations, seconds, and of predicted over actual cost.
  static constexpr std::array<double, 9> kSeconds = {0.001, 0.005, 0.025, 0.1, 0.5, 2, 10, 60, 300};
  static constexpr std::array<double, 7> kRatios = {0.25, 0.5, 0.8, 1.25, 2, 4, 16};

  /// A request that has ended. `route`: the pattern that matched, or empty; `problem`: the slug of
  /// its problem, or empty.
  void request(std::string_view route, std::string_view method, int status,
               std::string_view problem, double seconds);
  /// A render that is done: the rays it traced, the processor seconds predicted and used.
  void render(std::string_view method, std::uint64_t rays, double predicted_s, double actual_s);
  void render_failed() { ++failed_renders_; }
  void previews(std::uint64_t count) { previews_ += count; }

  /// The text format 0.0.4 without what others count.
  std::string text() const;

 private:
  template <std::size_t kBounds>
  struct Histogram {
    std::array<std::uint64_t, kBounds + 1> counts = {};
    double sum = 0.0;
    void add(double value, const std::array<double, kBounds>& bounds);
  };

  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::uint64_t> requests_ = {};  // by "METHOD route", status
  std::map<std::string, std::uint64_t, std::less<>> problems_ = {};
  std::map<std::string, std::uint64_t, std::less<>> renders_ = {};  // by method
  Histogram<kSeconds.size()> request_seconds_ = {};
  Histogram<kRatios.size()> cost_ratio_ = {};
  double predicted_s_ = 0.0;
  double actual_s_ = 0.0;
  std::uint64_t rays_ = 0;
  std::atomic<std::uint64_t> failed_renders_ = 0;
  std::atomic<std::uint64_t> previews_ = 0;
};

/// Lines of one metric with one value: help, type ("gauge" or "counter"), sample.
std::string metric_lines(std::string_view name, std::string_view type, std::string_view help,
                         double value);

/// What the kernel says of this process: memory, processor time, descriptors, start.
std::string process_metrics();

}  // namespace fstop::server
