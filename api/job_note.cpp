#include "api/job_note.h"

#include <cstdint>
#include <utility>

#include <nlohmann/json.hpp>

namespace fstop::api {
namespace {

using nlohmann::json;
using Milliseconds = std::chrono::milliseconds;

}  // namespace

std::string job_note_json(const JobNote& note) {
  json value = {{"turn", note.turn},
                {"render", note.render},
                {"format", note.format},
                {"client", note.client},
                {"body", note.body},
                {"idempotency_key", note.idempotency_key},
                {"fingerprint", note.fingerprint}};
  if (note.deadline) {
    const auto since = note.deadline->time_since_epoch();
    value["deadline_ms"] = std::chrono::duration_cast<Milliseconds>(since).count();
  }
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

JobNote parsed_job_note(std::string job, std::string_view text) {
  const json value = json::parse(text);
  JobNote note{.job = std::move(job),
               .turn = value.value("turn", std::uint64_t{0}),
               .render = value.at("render"),
               .format = value.at("format"),
               .client = value.at("client"),
               .body = value.at("body"),
               .idempotency_key = value.at("idempotency_key"),
               .fingerprint = value.at("fingerprint")};
  if (value.contains("deadline_ms")) {
    const Milliseconds since(value["deadline_ms"].get<std::int64_t>());
    note.deadline = std::chrono::system_clock::time_point(since);
  }
  return note;
}

}  // namespace fstop::api
