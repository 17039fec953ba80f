#include "core/render/parts.h"

#include <algorithm>
#include <cmath>

namespace fstop {
namespace {

constexpr double kRounding = 1e-9;  // of sums of shares

SampleRange missing(const ReplicateFilm& film, const BlockCounts& counts, int replicate,
                    std::size_t block) {
  const std::uint32_t first = film.samples(replicate, block);
  return {first, std::max(first, counts[static_cast<std::size_t>(replicate)][block])};
}

// Of both replicates, over the block's pixels.
std::uint64_t missing_samples(const ReplicateFilm& film, const BlockCounts& counts,
                              std::size_t block) {
  std::uint64_t samples = 0;
  for (int r = 0; r < kReplicates; ++r) {
    const SampleRange range = missing(film, counts, r, block);
    samples += range.end - range.first;
  }
  return samples * static_cast<unsigned>(film.grid().pixels(block));
}

}  // namespace

BlockGrid PartOrder::grid() const {
  BlockGrid made(width, height);
  made.interleaved = interleaved;
  return made;
}

std::size_t PartOrder::sums() const noexcept {
  std::size_t count = 0;
  for (const auto& ranges : samples) {
    for (const SampleRange& range : ranges) count += range.first < range.end ? 1U : 0U;
  }
  return count;
}

PartSums PartSums::of(const BlockSums& sums) noexcept {
  PartSums part{.least_defocus = sums.least_defocus};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      part.value[c][k] = static_cast<float>(sums.value[c][k]);
    }
  }
  return part;
}

BlockSums PartSums::block_sums() const noexcept {
  BlockSums sums{.least_defocus = least_defocus};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < kBlockPixels; ++k) {
      sums.value[c][k] = static_cast<double>(value[c][k]);
    }
  }
  return sums;
}

std::uint64_t missing_samples(const ReplicateFilm& film, const BlockCounts& counts) {
  std::uint64_t samples = 0;
  for (std::size_t block = 0; block < film.grid().count(); ++block)
    samples += missing_samples(film, counts, block);
  return samples;
}

std::vector<PartOrder> parts_of(const ReplicateFilm& film, const BlockCounts& counts, int count) {
  const double share =
      static_cast<double>(missing_samples(film, counts)) / static_cast<double>(std::max(count, 1));
  const std::size_t blocks = film.grid().count();
  std::vector<PartOrder> parts;
  double before = 0.0;  // samples of the parts so far
  for (std::size_t block = 0; block < blocks;) {
    if (missing_samples(film, counts, block) == 0) {  // no part begins with nothing
      ++block;
      continue;
    }
    PartOrder& part = parts.emplace_back();
    part.width = film.grid().width;
    part.height = film.grid().height;
    part.interleaved = film.grid().interleaved;
    part.first_block = block;
    std::size_t last = block;  // that lacks something
    // Up to the next multiple of a share: what one part has too much the next one has less.
    const double end = share * (std::floor(before / share + kRounding) + 1.0 - kRounding);
    do {
      const std::uint64_t samples = missing_samples(film, counts, block);
      before += static_cast<double>(samples);
      if (samples > 0) last = block;
      ++block;
    } while (block < blocks && block - part.first_block < kMostPartBlocks && before < end);
    for (int r = 0; r < kReplicates; ++r) {
      auto& ranges = part.samples[static_cast<std::size_t>(r)];
      for (std::size_t b = part.first_block; b <= last; ++b)
        ranges.push_back(missing(film, counts, r, b));
    }
  }
  return parts;
}

}  // namespace fstop
