#include "core/render/sample_loop.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "core/error.h"

namespace fstop {
namespace {

static_assert(kTile % kBlockSide == 0, "a tile is a whole number of blocks");
// Samples of a pixel traced in one visit of its tile: a visit takes milliseconds, so that
// progress flows and threads end together.
constexpr std::uint32_t kVisit = 256;

// Traces samples [first, first + count) of a block into the film's pass under way.
std::uint64_t trace_block(const SampleSource& source, const BlockGrid& grid, std::size_t block,
                          std::uint32_t first, std::uint32_t count, Film& film, SampleSink* sink) {
  std::array<PixelSums, kLanes> sums = {};
  BlockTracer tracer(source, grid, block);
  const std::uint64_t rays = tracer.trace(first, count, [&](const TracedPacket& traced) {
    if (sink != nullptr) sink->add(grid.left(block), grid.top(block), tracer.valid(), traced);
    const LaneColors& colors = traced.colors;
    for (std::size_t k = 0; k < kLanes; ++k) sums[k].add(colors.r[k], colors.g[k], colors.b[k]);
  });
  grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) { film.add(x, y, sums[lane]); });
  return rays;
}

// Reports a fraction that never decreases, from any thread.
class Progress {
 public:
  Progress(const RunControl& run, int total, double begin, double end)
      : run_(run), total_(total), begin_(begin), end_(end) {}
  void step() {
    const int done = 1 + done_.fetch_add(1);
    if (!run_.progress) return;
    const double fraction = begin_ + (end_ - begin_) * done / total_;
    const std::scoped_lock lock(mutex_);
    if (fraction <= reported_) return;
    reported_ = fraction;
    run_.progress(fraction);
  }

 private:
  const RunControl& run_;
  int total_;
  double begin_;
  double end_;
  std::atomic<int> done_ = 0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

}  // namespace

std::uint64_t trace_pass(const SampleSource& source, const SamplePass& pass, Film& film,
                         const RunControl& run) {
  const BlockGrid grid(film.width(), film.height());
  const int columns = (film.width() + kTile - 1) / kTile;
  const int rows = (film.height() + kTile - 1) / kTile;
  const std::uint32_t visit = std::min(pass.count, kVisit);
  std::atomic<std::uint64_t> rays = 0;
  Progress progress(run, columns * rows * static_cast<int>(pass.count / visit), pass.begin,
                    pass.end);
  for (std::uint32_t done = 0; done < pass.count; done += visit) {
    parallel_for(run, columns * rows, [&](int tile) {
      if (pass.tiles == nullptr || (*pass.tiles)[static_cast<std::size_t>(tile)] != 0) {
        for_each_block(grid, tile % columns, tile / columns, [&](std::size_t block) {
          if (run.stop.stop_requested()) return;
          rays += trace_block(source, grid, block, pass.first + done, visit, film, pass.sink);
        });
      }
      progress.step();
    });
  }
  throw_if_stopped(run);
  return rays;
}

}  // namespace fstop
