#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace fstop::api {

/// What an accepted job needs to be begun anew.
struct JobNote {
  std::string job = {};     // its name: lower case hexadecimal digits
  std::uint64_t turn = 0;   // grows in the order of acceptance
  std::string render = {};  // content hash
  std::string format = {};  // of the picture, by name
  std::string client = {};
  std::string body = {};             // of the request
  std::string idempotency_key = {};  // with the client before it; empty: none
  std::string fingerprint = {};      // of the key's request
  std::optional<std::chrono::system_clock::time_point> deadline = {};
};

/// `note` as JSON, without the job's name.
std::string job_note_json(const JobNote& note);

/// The note of `job` that `text` holds. Throws: std::exception where it is none.
JobNote parsed_job_note(std::string job, std::string_view text);

}  // namespace fstop::api
