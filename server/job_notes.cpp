#include "server/job_notes.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>
#include <unistd.h>

#include "server/commands.h"
#include "server/content_folder.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

bool is_name(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
  });
}

}  // namespace

JobNotes::JobNotes(fs::path folder, Log& log) : folder_(std::move(folder)), log_(log) {
  if (are_kept()) make_folder_durably(folder_);
}

void JobNotes::write(const api::JobNote& note) const {
  if (are_kept()) write_durably((folder_ / note.job).string(), api::job_note_json(note));
}

void JobNotes::forget(const std::string& job) const noexcept {
  if (are_kept()) ::unlink((folder_ / job).c_str());
}

std::vector<api::JobNote> JobNotes::all() {
  std::vector<api::JobNote> notes;
  std::error_code none;
  if (!are_kept()) return notes;
  for (const auto& entry : fs::directory_iterator(folder_, none)) {
    const std::string name = entry.path().filename().string();
    if (!is_name(name) || !entry.is_regular_file(none)) continue;
    try {
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::string text((std::istreambuf_iterator<char>(stream)), {});
      notes.push_back(api::parsed_job_note(name, text));
    } catch (const std::exception& exception) {
      log_.warning("job_note_left", {{"job", name.substr(0, 8)}, {"why", exception.what()}});
    }
  }
  std::ranges::sort(notes, {}, &api::JobNote::turn);
  if (!notes.empty()) turn_ = std::max(turn_.load(), notes.back().turn);
  return notes;
}

}  // namespace fstop::server
