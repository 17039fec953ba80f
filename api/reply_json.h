#pragma once

#include <string>
#include <string_view>

namespace fstop::api {

/// What a client of another fstop server reads of its replies.

/// Title, detail and faults of a problem document in one line; of a body that is none, its
/// beginning.
std::string told_problem(std::string_view body);

struct ToldJob {
  std::string state = {};    // as JobView::state
  std::string problem = {};  // of one that failed
};
/// Throws: InvalidRequest{malformed_json} where the body is not JSON.
ToldJob told_job(std::string_view body);

}  // namespace fstop::api
