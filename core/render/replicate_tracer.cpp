#include "core/render/replicate_tracer.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace fstop {
namespace {

// Samples of a pixel between two looks at the stop token: a few milliseconds of work.
constexpr std::uint32_t kVisit = 256;
constexpr std::uint32_t kSecondReplicate = 0x5eed0002U;
constexpr std::size_t kBlocksAtOnce = 16;  // of a part, that one thread traces

std::uint32_t seed_of(const Shot& shot, int replicate) {
  return replicate == 0 ? shot.seed : hash_of(shot.seed, kSecondReplicate);
}

// A pattern is one of all samples that the replicate will have.
std::optional<PatternTables> tables_of(const Shot& shot, int replicate) {
  const QualitySpec& quality = shot.quality;
  if (!quality.sampling.any() || !quality.samples) return {};
  const int samples = (*quality.samples + 1 - replicate) / 2;
  if (samples < 1) return {};
  return PatternTables(quality.sampling, samples, seed_of(shot, replicate));
}

}  // namespace

ReplicateTracer::ReplicateTracer(const SampleSource& source, const Shot& shot)
    : patterns_{tables_of(shot, 0), tables_of(shot, 1)},
      sources_{with_sequence(source, shot, 0), with_sequence(source, shot, 1)} {}

SampleSource ReplicateTracer::with_sequence(SampleSource source, const Shot& shot,
                                            int replicate) const {
  const auto& tables = patterns_[static_cast<std::size_t>(replicate)];
  source.sequence = SampleSequence(seed_of(shot, replicate), tables ? &*tables : nullptr);
  return source;
}

ReplicateTracer::Traced ReplicateTracer::trace(int replicate, const BlockGrid& grid,
                                               std::size_t block, SampleRange samples,
                                               const std::stop_token& stop) const {
  Traced traced;
  BlockTracer tracer(sources_[static_cast<std::size_t>(replicate)], grid, block);
  for (std::uint32_t first = samples.first; first < samples.end; first += kVisit) {
    if (stop.stop_requested()) return traced;
    traced.rays += tracer.trace(first, std::min(kVisit, samples.end - first), traced.sums);
  }
  traced.cut_squares = static_cast<std::uint64_t>(std::llround(kCutScale * tracer.cut_squares()));
  traced.is_whole = true;
  return traced;
}

TracedPart ReplicateTracer::trace(const PartOrder& order, const RunControl& run) const {
  struct Work {
    std::size_t block = 0;
    int replicate = 0;
    SampleRange samples = {};
  };
  std::vector<Work> works;
  for (std::size_t i = 0; i < order.blocks(); ++i) {
    for (int r = 0; r < kReplicates; ++r) {
      const SampleRange range = order.samples[static_cast<std::size_t>(r)][i];
      if (range.first < range.end) works.push_back({order.first_block + i, r, range});
    }
  }
  const BlockGrid grid = order.grid();
  TracedPart part;
  part.sums.resize(works.size());
  std::atomic<std::uint64_t> rays = 0;
  std::atomic<std::uint64_t> cut_squares = 0;
  const std::size_t visits = (works.size() + kBlocksAtOnce - 1) / kBlocksAtOnce;
  parallel_for(run, static_cast<int>(visits), [&](int visit) {
    const std::size_t begin = kBlocksAtOnce * static_cast<std::size_t>(visit);
    for (std::size_t i = begin; i < std::min(begin + kBlocksAtOnce, works.size()); ++i) {
      const Work& work = works[i];
      const Traced traced = trace(work.replicate, grid, work.block, work.samples, run.stop);
      part.sums[i] = PartSums::of(traced.sums);
      rays += traced.rays;
      cut_squares += traced.cut_squares;
    }
  });
  throw_if_stopped(run);
  part.rays = rays;
  part.cut_squares = cut_squares;
  return part;
}

}  // namespace fstop
