#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fstop::api {

/// One file of an archive.
struct ArchiveEntry {
  std::string name = {};
  std::vector<std::byte> bytes = {};
};

/// Bounds on what an archive may hold; each is checked before memory is taken for it.
struct ArchiveLimits {
  std::size_t packed_bytes = std::size_t{64} << 20;
  std::size_t unpacked_bytes = std::size_t{256} << 20;
  std::size_t entries = 1000;
  double ratio = 100.0;  // unpacked over packed, of each entry over 64 KiB
};

/// The files of a zip archive (PKWARE APPNOTE 6.3, stored or deflated, no zip64, one disk), in the
/// order of its directory. Folders are passed over.
/// Throws: Error{bad_path} for a name that is absolute, has a part that is empty or begins with a
///         dot, or holds other than letters, digits, '.', '_', '-' and '/';
///         Error{over_budget} beyond `limits`;
///         Error{unsupported} for links, encryption, other methods, zip64;
///         Error{invalid_request} for what is damaged, named twice, or lies where something else
///         does.
std::vector<ArchiveEntry> unzip(std::span<const std::byte> bytes, const ArchiveLimits& limits);

/// Whether an archive or a scene may have a file of this name: see unzip.
bool is_plain_name(std::string_view name);

}  // namespace fstop::api
