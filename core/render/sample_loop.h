#pragma once

#include <cstdint>
#include <vector>

#include "core/film/film.h"
#include "core/parallel.h"
#include "core/render/block_tracer.h"

namespace fstop {

/// Sees every sample of a pass; samples of one tile come from one thread at a time.
class SampleSink {
 public:
  virtual ~SampleSink() = default;
  /// (left, top): the block's upper left pixel; lane k is pixel (left + k % 4, top + k / 4).
  virtual void add(int left, int top, const LaneMask& valid, const TracedPacket& packet) = 0;
};

/// Calls visit(block) for the blocks of a tile.
template <typename Visit>
void for_each_block(const BlockGrid& grid, int tile_column, int tile_row, const Visit& visit) {
  constexpr int kSide = kTile / kBlockSide;
  const int right = std::min(grid.columns, (tile_column + 1) * kSide);
  const int bottom = std::min(grid.rows, (tile_row + 1) * kSide);
  for (int row = tile_row * kSide; row < bottom; ++row) {
    for (int column = tile_column * kSide; column < right; ++column) {
      visit(grid.index(column, row));
    }
  }
}

/// Which samples a pass takes, of which pixels.
struct SamplePass {
  std::uint32_t first = 0;                   // a multiple of count
  std::uint32_t count = 1;                   // a power of two
  double begin = 0.0;                        // progress reported goes from here
  double end = 1.0;                          // to here
  const std::vector<char>* tiles = nullptr;  // row by row: nonzero where traced; null: everywhere
  SampleSink* sink = nullptr;
};

/// Traces a pass into `film`'s pass under way and returns the number of rays.
/// Throws: Error{cancelled} within a few milliseconds of a stop.
std::uint64_t trace_pass(const SampleSource& source, const SamplePass& pass, Film& film,
                         const RunControl& run);

}  // namespace fstop
