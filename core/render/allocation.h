#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/film/replicate_film.h"

namespace fstop {

/// How many samples every block of every replicate shall have.
using BlockCounts = std::array<std::vector<std::uint32_t>, kReplicates>;

/// What an allocation is to reach, and what it may spend.
struct AllocationGoal {
  double mse = 0.0;                         // of the mean of both replicates
  double measured = 0.0;                    // the same now
  double most_growth = 4.0;                 // of a block's count, in this round
  double budget = 0.0;                      // further samples over all pixels
  std::uint32_t most_samples = 32768;       // of a pixel in one replicate
  double order = ReplicateFilm::kNetOrder;  // t of the law
  /// By block: what of its error the finished picture has; null: all.
  const std::vector<float>* shares = nullptr;
};

struct Allocation {
  BlockCounts counts = {};
  double predicted_mse = 0.0;
  double samples = 0.0;       // further samples over all pixels
  double last_samples = 0.0;  // with those that further rounds give, until the error is reached
};

/// Counts that minimise the samples at a given error: of a block with the law V n^-t, n in
/// proportion to V^(1/(1+t)). V of one replicate's block is what the other replicate's
/// neighbourhood of 3 x 3 blocks shows. Counts are 2^k or 3 * 2^k, so that every block's samples
/// stay aligned nets, and never fall.
Allocation allocated(const ReplicateFilm& film, const AllocationGoal& goal);

}  // namespace fstop
