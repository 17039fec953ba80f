#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "api/limits.h"
#include "server/log.h"

namespace fstop::server {

struct StoredRender;

/// Finished renders in files, one for each id: those used last, within a bound on their bytes. A
/// file is complete or not there (written beside, flushed, renamed), carries the hash of its bytes
/// and is thrown away where it does not fit. What a former process left is found again.
class ResultStore {
 public:
  struct Counts {
    std::uint64_t files = 0;
    std::uint64_t bytes = 0;
    std::uint64_t loaded = 0;  // since the start, as the rest
    std::uint64_t saved = 0;
    std::uint64_t evicted = 0;
    std::uint64_t damaged = 0;  // thrown away
  };

  /// Without `folder` nothing is kept. Makes the folder.
  /// Throws: Error{io_failure} if that cannot be done.
  ResultStore(std::filesystem::path folder, std::size_t max_bytes, const api::Limits& limits,
              Log& log);

  /// Returns once the render lies on the disk. Throws: Refusal 507 if there is no room for it,
  /// Error{io_failure}.
  void save(const StoredRender& render);
  /// Null if there is none, or none that is whole.
  std::shared_ptr<StoredRender> load(const std::string& id);
  Counts counts() const;

 private:
  struct Entry {
    std::string id = {};
    std::uint64_t bytes = 0;
  };
  std::filesystem::path file_of(const std::string& id) const;
  void find_what_is_there();
  void remember(const std::string& id, std::uint64_t bytes);
  void forget(const std::string& id);
  void make_room(std::uint64_t bytes);

  std::filesystem::path folder_;
  std::uint64_t max_bytes_;
  const api::Limits& limits_;
  Log& log_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_ = {};  // the one used last first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_id_ = {};
  Counts counts_ = {};
};

}  // namespace fstop::server
