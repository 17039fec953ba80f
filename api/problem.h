#pragma once

#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/limits.h"
#include "core/error.h"

namespace fstop::api {

/// One fault of a request: where, as a JSON pointer in a URI fragment ("#/camera/lens/f_number",
/// RFC 6901 section 6), and what is wrong with it.
struct FieldFault {
  std::string pointer = {};
  std::string detail = {};

  friend bool operator==(const FieldFault&, const FieldFault&) = default;
};

/// A request that is refused, with all its faults.
class InvalidRequest : public Error {
 public:
  /// `code`: invalid_request; or malformed_json, over_budget where the faults are of that kind.
  /// `unlisted`: how many faults there are beside.
  explicit InvalidRequest(std::vector<FieldFault> faults,
                          ErrorCode code = ErrorCode::invalid_request, std::size_t unlisted = 0);
  explicit InvalidRequest(FieldFault fault, ErrorCode code = ErrorCode::invalid_request)
      : InvalidRequest(std::vector<FieldFault>{std::move(fault)}, code) {}
  const std::vector<FieldFault>& faults() const noexcept { return faults_; }
  std::size_t unlisted() const noexcept { return unlisted_; }

 private:
  std::vector<FieldFault> faults_;
  std::size_t unlisted_ = 0;
};

/// Collects the faults of one request, up to a bound: what lies beyond is only counted.
class FaultList {
 public:
  explicit FaultList(std::size_t most = Limits{}.faults) : most_(most) {}

  void add(std::string_view pointer, std::string detail);
  bool empty() const noexcept { return faults_.empty(); }
  std::size_t size() const noexcept { return faults_.size(); }
  const std::vector<FieldFault>& faults() const noexcept { return faults_; }
  /// Throws: InvalidRequest with the faults, if there are any.
  void throw_if_any() const;

 private:
  std::size_t most_;
  std::size_t unlisted_ = 0;
  std::vector<FieldFault> faults_ = {};
};

/// What a render is predicted to take.
struct CostPrediction {
  double samples = 0.0;  // over all pixels
  double cpu_s = 0.0;    // of all threads
  double wall_s = 0.0;   // on this server's threads, without waiting
  double memory_bytes = 0.0;

  friend bool operator==(const CostPrediction&, const CostPrediction&) = default;
};

/// An error as clients see it (RFC 9457).
struct Problem {
  int status = 500;
  std::string type = {};  // stable, "/problems/json-invalid"
  std::string title = {};
  std::string detail = {};
  std::vector<FieldFault> errors = {};
  std::size_t unlisted = 0;                       // faults beside them
  std::optional<CostPrediction> prediction = {};  // of what is over budget
};

/// The problem that an exception is:
///
///     malformed_json                                      400 json-invalid
///     not_found                                           404 not-found
///     invalid_request                                     422 invalid-request
///     outside_domain, bad_geometry, bad_image, bad_path,
///     over_budget, no_valid_method, unsupported           422 of the same name, "-" for "_"
///     cancelled, and std::bad_alloc as "overloaded"       503
///     io_failure, internal, any other exception           500
///
/// What a 500 says is "internal": the cause belongs in the log (exception.what()), not here.
Problem problem(const std::exception& exception);

/// A problem of HTTP itself. `slug`: "body-too-large", "method-not-allowed", "queue-full", ...;
/// the title is the slug in words.
Problem http_problem(int status, std::string_view slug, std::string detail);

/// `application/problem+json`: at most 16 KiB (the last faults give way to a count of them), valid
/// UTF-8 whatever the input was.
std::string to_json(const Problem& problem);

/// At most `max_bytes` of `text`, ending in "..." where some is missing; never inside a UTF-8
/// sequence.
std::string shortened(std::string_view text, std::size_t max_bytes);

}  // namespace fstop::api
