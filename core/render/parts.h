#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/replicate_film.h"
#include "core/parallel.h"
#include "core/render/allocation.h"

namespace fstop {

/// Samples [first, end) of every pixel of a block, in one replicate.
struct SampleRange {
  std::uint32_t first = 0;
  std::uint32_t end = 0;
  bool operator==(const SampleRange&) const = default;
};

/// Consecutive blocks of a picture, and which of their samples are to be taken. Beside the request
/// and the scene it says all that decides what these samples see: whoever traces them plans nothing
/// and so cannot plan otherwise.
struct PartOrder {
  std::string method = {};          // of the picture: RenderMethod::name
  std::uint32_t sharp_samples = 0;  // > 0: of the layer all_in_focus, by so many
  int width = 0;                    // of the picture, pixels
  int height = 0;
  std::vector<std::uint8_t> interleaved = {};  // BlockGrid::interleaved
  std::size_t first_block = 0;
  /// By replicate and block, as many of each.
  std::array<std::vector<SampleRange>, kReplicates> samples = {};

  std::size_t blocks() const noexcept { return samples[0].size(); }
  BlockGrid grid() const;
  /// Ranges that are not empty.
  std::size_t sums() const noexcept;
  bool operator==(const PartOrder&) const = default;
};

/// What the samples of one range add to the film: BlockSums in single precision, as it keeps them.
struct PartSums {
  std::array<std::array<float, kBlockPixels>, 3> value = {};
  float least_defocus = 0.0F;

  static PartSums of(const BlockSums& sums) noexcept;
  BlockSums block_sums() const noexcept;
};

/// A part as it was traced.
struct TracedPart {
  std::vector<PartSums> sums = {};  // of the ranges that are not empty: by block, then by replicate
  std::uint64_t rays = 0;
  std::uint64_t cut_squares = 0;  // ReplicateTracer::Traced
};

/// Has the samples of a picture's rounds traced elsewhere: by other processes with the same build,
/// request and scene.
class PartTracer {
 public:
  using Take = std::function<void(std::size_t number, const TracedPart& part)>;
  virtual ~PartTracer() = default;
  /// Into how many parts a round of `samples` over all pixels is to be cut; 0: whoever asks traces
  /// it. Of equal rounds the same, so that the same picture made again asks for the same parts.
  virtual int parts(double samples) const = 0;
  /// Calls take(number, part) once for each order, in any order, one call at a time, on this
  /// thread; what is taken has as many sums as the order. Throws: Error{cancelled}.
  virtual void trace(std::span<const PartOrder> orders, const Take& take,
                     const RunControl& run) = 0;
};

/// What `film` lacks to `counts`, in at most `count` runs of about as many samples each, or in more
/// where such runs had over kMostPartBlocks blocks. Without method and sharp_samples.
std::vector<PartOrder> parts_of(const ReplicateFilm& film, const BlockCounts& counts, int count);
/// Samples over all pixels that it lacks.
std::uint64_t missing_samples(const ReplicateFilm& film, const BlockCounts& counts);

/// Blocks of a part: what it becomes has at most 52 MB.
inline constexpr std::size_t kMostPartBlocks = std::size_t{1} << 17;

/// Orders and parts as bytes: a name and version of the form, then little endian numbers. A part
/// names the order that it belongs to.
std::string bytes_of(const PartOrder& order);
std::string bytes_of(const TracedPart& part, const PartOrder& order);
/// The inverses. Bytes are foreign: nothing is allocated that they do not fill, and every number
/// lies where it can. Throws: Error{invalid_request} for what cannot be an order, for what is no
/// part of `order`.
PartOrder part_order_of(std::string_view bytes);
TracedPart traced_part_of(std::string_view bytes, const PartOrder& order);

}  // namespace fstop
