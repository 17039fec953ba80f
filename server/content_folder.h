#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "server/sweep_cells.h"

namespace fstop::server {

/// A content store in a folder: "ab/cdef..." holds the bytes whose hash is abcdef... A file is
/// whole or not there. Any thread; one process at a time.
class ContentFolder : public ContentStore {
 public:
  /// Makes the folder; throws away what a former process left half written.
  /// Throws: Error{io_failure}, Refusal 507.
  explicit ContentFolder(std::filesystem::path folder);

  std::string put(std::string_view bytes) override;
  std::optional<std::string> get(std::string_view sha256) override;
  void remove(std::string_view sha256) noexcept override;
  /// Where the bytes of `sha256` lie, or would.
  std::filesystem::path path_of(std::string_view sha256) const;
  /// Whether they are there, by their number: what is written is written whole.
  bool has(const CellFile& file) const;
  /// Whether they are there and what their hash says: reads them.
  bool is_whole(const CellFile& file);

 private:
  std::filesystem::path folder_;
};

/// Makes `folder` and those above it, their names flushed to the disk.
/// Throws: Refusal 507 where there is no room, else Error{io_failure}.
void make_folder_durably(const std::filesystem::path& folder);

/// Gives `file` another name, in place of whatever has it; where the file system has no hard links,
/// by a copy. Throws: as make_folder_durably.
void link_durably(const std::filesystem::path& file, const std::filesystem::path& name);

}  // namespace fstop::server
