#pragma once

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
  /// Returns once the note lies on the disk. Throws: as the constructor.
  void write(const api::JobNote& note) const;
  void forget(const std::string& job) const noexcept;
  /// What is there, the oldest first. A file that is no note is told in the log and left alone.
  std::vector<api::JobNote> all() const;

 private:
  std::filesystem::path folder_;
  Log& log_;
};

}  // namespace fstop::server
