#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "core/study/image_baseline.h"

namespace fstop::api {

/// By how much a baseline differed from the one before it.
struct BaselineChange {
  double rmse = 0.0;
  double largest_deviation = 0.0;                      // |t| on any level
  std::array<double, 3> brightness = {1.0, 1.0, 1.0};  // new total over old
};

/// One time that somebody accepted a baseline.
struct BaselineAcceptance {
  std::string who = {};
  std::string why = {};
  std::string engine = {};
  std::optional<BaselineChange> change = {};  // none: it was the first
};

/// What stands in the JSON file beside a baseline's EXR.
struct BaselineRecord {
  std::string request = {};  // normalised, as RenderRequest::normalised
  std::string image_sha256 = {};
  int replicates = 0;
  std::array<double, 3> total = {};
  std::array<double, 3> total_variance = {};
  std::vector<BaselineAcceptance> accepted = {};  // the newest first
};

std::string baseline_record_json(const BaselineRecord& record);
/// Throws: InvalidRequest with every fault.
BaselineRecord parse_baseline_record(std::string_view text, const Limits& limits);

/// The EXR file of a baseline: R, G, B the mean, var.* a pixel's variance, block.* its block's.
std::vector<std::byte> baseline_file(const ImageBaseline& baseline);
/// The same back, with what its record holds.
/// Throws: Error{bad_image} where the bytes are not those that the record was written for.
ImageBaseline baseline_of(std::span<const std::byte> file, const BaselineRecord& record);

/// The render request of `normalised` as EXR with another seed.
std::string request_with_seed(std::string_view normalised, std::uint32_t seed);
/// The seed of a request's replicate, from 0 on: never the request's own, each another.
std::uint32_t replicate_seed(std::uint32_t own, int replicate);

}  // namespace fstop::api
