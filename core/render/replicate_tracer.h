#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stop_token>

#include "core/render/block_tracer.h"
#include "core/render/method.h"
#include "core/render/parts.h"
#include "core/sampling/patterns.h"

namespace fstop {

/// Takes samples of a shot's blocks, in either replicate of its picture. What a block's samples see
/// depends on nothing else: neither on other blocks nor on who takes them.
class ReplicateTracer {
 public:
  /// What `source` refers to must outlive it.
  ReplicateTracer(const SampleSource& source, const Shot& shot);
  ReplicateTracer(const ReplicateTracer&) = delete;
  ReplicateTracer& operator=(const ReplicateTracer&) = delete;

  struct Traced {
    BlockSums sums = {};
    std::uint64_t rays = 0;
    /// BlockTracer::cut_squares times kCutScale. In whole numbers, so that a sum over blocks does
    /// not depend on their order.
    std::uint64_t cut_squares = 0;
    bool is_whole = false;
  };
  static constexpr double kCutScale = 0x1p30;

  /// Looks at `stop` every few milliseconds, then leaves the rest.
  Traced trace(int replicate, const BlockGrid& grid, std::size_t block, SampleRange samples,
               const std::stop_token& stop) const;

  /// The samples of `order`. Throws: Error{cancelled}.
  TracedPart trace(const PartOrder& order, const RunControl& run) const;

 private:
  SampleSource with_sequence(SampleSource source, const Shot& shot, int replicate) const;

  std::array<std::optional<PatternTables>, kReplicates> patterns_;
  std::array<SampleSource, kReplicates> sources_;
};

}  // namespace fstop
