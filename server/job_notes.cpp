#include "server/job_notes.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>
#include <unistd.h>
#include <utility>

#include <nlohmann/json.hpp>

#include "server/commands.h"
#include "server/content_folder.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Milliseconds = std::chrono::milliseconds;

bool is_name(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
  });
}

std::string text_of(const JobNote& note) {
  json value = {{"render", note.render},
                {"format", note.format},
                {"client", note.client},
                {"body", note.body},
                {"idempotency_key", note.idempotency_key},
                {"fingerprint", note.fingerprint}};
  if (note.deadline) {
    const auto since = note.deadline->time_since_epoch();
    value["deadline_ms"] = std::chrono::duration_cast<Milliseconds>(since).count();
  }
  return value.dump();
}

JobNote note_of(std::string job, const std::string& text) {
  const json value = json::parse(text);
  JobNote note{.job = std::move(job),
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

}  // namespace

JobNotes::JobNotes(fs::path folder, Log& log) : folder_(std::move(folder)), log_(log) {
  if (are_kept()) make_folder_durably(folder_);
}

void JobNotes::write(const JobNote& note) const {
  if (are_kept()) write_durably((folder_ / note.job).string(), text_of(note));
}

void JobNotes::forget(const std::string& job) const noexcept {
  if (are_kept()) ::unlink((folder_ / job).c_str());
}

std::vector<JobNote> JobNotes::all() const {
  std::vector<std::pair<fs::file_time_type, JobNote>> found;
  std::error_code none;
  if (!are_kept()) return {};
  for (const auto& entry : fs::directory_iterator(folder_, none)) {
    const std::string name = entry.path().filename().string();
    if (!is_name(name)) continue;
    try {
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::string text((std::istreambuf_iterator<char>(stream)), {});
      found.emplace_back(entry.last_write_time(), note_of(name, text));
    } catch (const std::exception& exception) {
      log_.warning("job_note_left", {{"job", name.substr(0, 8)}, {"why", exception.what()}});
    }
  }
  std::ranges::stable_sort(found, {}, [](const auto& entry) { return entry.first; });
  std::vector<JobNote> notes;
  for (auto& [written, note] : found) notes.push_back(std::move(note));
  return notes;
}

}  // namespace fstop::server
