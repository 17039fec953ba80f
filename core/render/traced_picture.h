#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/render/allocation.h"
#include "core/render/parts.h"
#include "core/render/replicate_tracer.h"
#include "core/render/sample_loop.h"

namespace fstop {

inline double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// A picture under way: what traces it, here or in parts elsewhere, and its film.
class TracedPicture {
 public:
  using Clock = std::chrono::steady_clock;

  TracedPicture(const SampleSource& source, BlockGrid grid, const Shot& shot, const RunControl& run)
      : tracer_(source, shot), parts_(shot.parts), film_(std::move(grid)), run_(run) {}

  ReplicateFilm& film() { return film_; }
  std::uint64_t rays() const { return rays_; }
  double samples() const { return samples_; }
  // Root mean square over samples of the weight of branches that were not followed.
  double cut_rmse() const {
    const double sum = static_cast<double>(cut_squares_.load()) / ReplicateTracer::kCutScale;
    return samples_ > 0.0 ? std::sqrt(sum / samples_) : 0.0;
  }
  double pixels() const { return static_cast<double>(film_.grid().width) * film_.grid().height; }
  double samples_per_ms() const { return samples_ / std::max(trace_ms_, 1e-3); }

  // Traces what is missing to `counts`, or has it traced, but begins no tile after `deadline`;
  // progress goes to `end` of the whole.
  void trace(const BlockCounts& counts, double end,
             Clock::time_point deadline = Clock::time_point::max()) {
    if (trace_in_parts(counts, end)) return;
    const Clock::time_point start = Clock::now();
    const double begin = progress_;
    std::atomic<int> done = 0;
    const int columns = film_.grid().tile_columns();
    const int tiles = columns * film_.grid().tile_rows();
    std::atomic<std::uint64_t> rays = 0;
    std::atomic<std::uint64_t> samples = 0;
    const bool limited = deadline != Clock::time_point::max();
    parallel_for(run_, tiles, [&](int tile) {
      if (limited && Clock::now() >= deadline) return;
      for_each_block(film_.grid(), tile % columns, tile / columns, [&](std::size_t block) {
        for (int r = 0; r < kReplicates; ++r) {
          const auto counted = trace_block(r, block, counts);
          rays += counted.rays;
          samples += counted.samples;
        }
      });
      report(begin + (end - begin) * ++done / tiles);
    });
    throw_if_stopped(run_);
    rays_ += rays;
    samples_ += static_cast<double>(samples.load());
    progress_ = end;
    trace_ms_ += ms_since(start);
  }

  // One sample a pixel in replicate A, and in B for a few blocks chosen blindly, which tell the
  // error.
  BlockCounts first_look(std::uint32_t seed) const {
    constexpr std::uint32_t kOneIn = 16;
    BlockCounts counts = uniform(1, 0);
    for (std::size_t block = 0; block < counts[1].size(); ++block) {
      const bool chosen = hash_of(seed, static_cast<std::uint32_t>(block)) % kOneIn == 0;
      counts[1][block] = chosen || block == 0 ? 1 : 0;
    }
    return counts;
  }
  BlockCounts uniform(std::uint32_t a, std::uint32_t b) const {
    BlockCounts counts;
    counts[0].assign(film_.grid().count(), a);
    counts[1].assign(film_.grid().count(), b);
    return counts;
  }

  /// At least `count` for blocks that show mirrors, glass or textures fixed to the picture.
  BlockCounts where_sharp(std::uint32_t count) const {
    BlockCounts counts;
    for (int r = 0; r < kReplicates; ++r) {
      std::vector<std::uint32_t>& all = counts[static_cast<std::size_t>(r)];
      for (std::size_t block = 0; block < film_.grid().count(); ++block) {
        const std::uint32_t now = film_.samples(r, block);
        all.push_back(film_.least_defocus(block) > 0.0F ? now : std::max(now, count));
      }
    }
    return counts;
  }

  double progress() const { return progress_; }
  void report(double fraction) {
    if (!run_.progress) return;
    const std::scoped_lock lock(mutex_);
    if (fraction <= reported_) return;
    reported_ = fraction;
    run_.progress(fraction);
  }

 private:
  struct Counted {
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
  };

  Counted trace_block(int replicate, std::size_t block, const BlockCounts& counts) {
    const SampleRange samples{.first = film_.samples(replicate, block),
                              .end = counts[static_cast<std::size_t>(replicate)][block]};
    if (samples.first >= samples.end) return {};
    const auto traced = tracer_.trace(replicate, film_.grid(), block, samples, run_.stop);
    if (!traced.is_whole) return {};
    const std::uint32_t missing = samples.end - samples.first;
    film_.add(replicate, block, traced.sums, missing);
    cut_squares_ += traced.cut_squares;
    return {.rays = traced.rays,
            .samples = std::uint64_t{missing} * static_cast<unsigned>(film_.grid().pixels(block))};
  }

  // Whether others have traced all that was missing.
  bool trace_in_parts(const BlockCounts& counts, double end) {
    if (parts_.tracer == nullptr) return false;
    const auto missing = static_cast<double>(missing_samples(film_, counts));
    const int count = parts_.tracer->parts(missing);
    if (count < 1) return false;
    std::vector<PartOrder> orders = parts_of(film_, counts, count);
    for (PartOrder& order : orders) {
      order.method = parts_.method;
      order.sharp_samples = parts_.sharp_samples;
    }
    const double begin = progress_;
    std::size_t done = 0;
    const auto take = [&](std::size_t number, const TracedPart& part) {
      add(orders.at(number), part);
      report(begin +
             (end - begin) * static_cast<double>(++done) / static_cast<double>(orders.size()));
    };
    parts_.tracer->trace(orders, take, run_);
    throw_if_stopped(run_);
    samples_ += missing;
    progress_ = end;
    return true;
  }

  void add(const PartOrder& order, const TracedPart& part) {
    if (part.sums.size() != order.sums())
      throw Error(ErrorCode::internal, "a part is not what was ordered");
    auto sums = part.sums.begin();
    for (std::size_t i = 0; i < order.blocks(); ++i) {
      for (int r = 0; r < kReplicates; ++r) {
        const SampleRange& range = order.samples[static_cast<std::size_t>(r)][i];
        if (range.first >= range.end) continue;
        film_.add(r, order.first_block + i, sums->block_sums(), range.end - range.first);
        ++sums;
      }
    }
    rays_ += part.rays;
    cut_squares_ += part.cut_squares;
  }

  ReplicateTracer tracer_;
  PictureParts parts_;
  ReplicateFilm film_;
  const RunControl& run_;
  std::uint64_t rays_ = 0;
  double samples_ = 0.0;
  std::atomic<std::uint64_t> cut_squares_ = 0;  // ReplicateTracer::Traced
  double trace_ms_ = 0.0;                       // spent in trace()
  double progress_ = 0.0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

}  // namespace fstop
