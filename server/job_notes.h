#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "api/job_note.h"
#include "server/log.h"

namespace fstop::server {

/// The notes of jobs that clients were told of, a file each: whole or not there. They outlive the
/// process, so that what was accepted is made whatever happens to it. Any thread; one process at a
/// time.
class JobNotes {
 public:
  /// Without `folder` nothing is kept. Makes the folder.
  /// Throws: Error{io_failure}, Refusal 507 where there is no room.
  JobNotes(std::filesystem::path folder, Log& log);

  bool are_kept() const noexcept { return !folder_.empty(); }
  /// The turn of a job that is accepted now: above those of all() and of all before.
  std::uint64_t next_turn() noexcept { return ++turn_; }
  /// Returns once the note lies on the disk. Throws: as the constructor.
  void write(const api::JobNote& note) const;
  void forget(const std::string& job) const noexcept;
  /// What is there, in the order of their turns. A file that is no note is told in the log and left
  /// alone.
  std::vector<api::JobNote> all();

 private:
  std::filesystem::path folder_;
  Log& log_;
  std::atomic<std::uint64_t> turn_ = 0;  // the last one given
};

}  // namespace fstop::server
