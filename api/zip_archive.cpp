#include "api/zip_archive.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <string_view>
#include <utility>
#include <zlib.h>

#include "core/error.h"

namespace fstop::api {
namespace {

// Sizes and places of the records (APPNOTE 4.3.7, 4.3.12, 4.3.16).
constexpr std::uint32_t kLocalMark = 0x04034b50;
constexpr std::uint32_t kEntryMark = 0x02014b50;
constexpr std::uint32_t kEndMark = 0x06054b50;
constexpr std::size_t kLocalBytes = 30;
constexpr std::size_t kEntryBytes = 46;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kLongestComment = 65535;
constexpr std::size_t kLongestName = 255;
constexpr std::size_t kFreeRatioBytes = std::size_t{64} << 10;

[[noreturn]] void damaged(const std::string& what) {
  throw Error(ErrorCode::invalid_request, "the archive is damaged: " + what);
}

class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::size_t size() const { return bytes_.size(); }
  std::uint32_t u16(std::size_t at) const { return byte(at) | byte(at + 1) << 8U; }
  std::uint32_t u32(std::size_t at) const { return u16(at) | u16(at + 2) << 16U; }
  std::span<const std::byte> part(std::size_t at, std::size_t count) const {
    if (at > size() || count > size() - at) damaged("something lies behind its end");
    return bytes_.subspan(at, count);
  }

 private:
  std::uint32_t byte(std::size_t at) const {
    if (at >= size()) damaged("something lies behind its end");
    return static_cast<std::uint32_t>(bytes_[at]);
  }
  std::span<const std::byte> bytes_;
};

struct Record {
  std::string name = {};
  std::uint32_t flags = 0;
  std::uint32_t method = 0;
  std::uint32_t checksum = 0;
  std::size_t packed = 0;
  std::size_t unpacked = 0;
  std::size_t offset = 0;
  std::uint32_t made_by = 0;
  std::uint32_t attributes = 0;
};

// The end record is the last thing but its comment.
std::size_t end_of(const Bytes& zip) {
  if (zip.size() < kEndBytes) damaged("it is too short");
  const std::size_t last = zip.size() - kEndBytes;
  const std::size_t first = last - std::min(last, kLongestComment);
  for (std::size_t at = last + 1; at-- > first;) {
    if (zip.u32(at) == kEndMark && at + kEndBytes + zip.u16(at + 20) == zip.size()) return at;
  }
  damaged("it has no directory");
}

Record record_at(const Bytes& zip, std::size_t at) {
  if (zip.u32(at) != kEntryMark) damaged("its directory is not whole");
  Record record{.flags = zip.u16(at + 8),
                .method = zip.u16(at + 10),
                .checksum = zip.u32(at + 16),
                .packed = zip.u32(at + 20),
                .unpacked = zip.u32(at + 24),
                .offset = zip.u32(at + 42),
                .made_by = zip.u16(at + 4) >> 8U,
                .attributes = zip.u32(at + 38)};
  const auto name = zip.part(at + kEntryBytes, zip.u16(at + 28));
  record.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return record;
}

void check(const Record& record, const ArchiveLimits& limits) {
  const std::string name = record.name.substr(0, kLongestName);
  const bool is_folder = record.name.ends_with('/');
  if (!is_plain_name(is_folder ? record.name.substr(0, record.name.size() - 1) : record.name))
    throw Error(ErrorCode::bad_path, "the archive holds a file whose name is not a plain path");
  constexpr std::uint32_t kUnix = 3;
  constexpr std::uint32_t kKind = 0170000;
  constexpr std::uint32_t kRegular = 0100000;
  constexpr std::uint32_t kFolder = 0040000;
  const std::uint32_t kind = record.made_by == kUnix ? (record.attributes >> 16U) & kKind : 0;
  if (kind != 0 && kind != kRegular && kind != kFolder)
    throw Error(ErrorCode::unsupported, name + " is a link or a device");
  if ((record.flags & 0x2041U) != 0) throw Error(ErrorCode::unsupported, name + " is encrypted");
  if (record.method != 0 && record.method != 8)
    throw Error(ErrorCode::unsupported, name + " is neither stored nor deflated");
  if (record.packed == 0xFFFF'FFFF || record.unpacked == 0xFFFF'FFFF)
    throw Error(ErrorCode::unsupported, name + " needs zip64");
  const double most = limits.ratio * static_cast<double>(std::max<std::size_t>(record.packed, 1));
  if (record.unpacked > kFreeRatioBytes && static_cast<double>(record.unpacked) > most)
    throw Error(ErrorCode::over_budget, name + " unpacks to more than its size can mean");
}

std::vector<std::byte> inflated(std::span<const std::byte> packed, const Record& record) {
  std::vector<std::byte> bytes(record.unpacked);
  z_stream stream = {};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  // zlib takes no const input, but does not write to it.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  const int status = inflate(&stream, Z_FINISH);
  const bool is_whole = status == Z_STREAM_END && stream.avail_out == 0 && stream.avail_in == 0;
  inflateEnd(&stream);
  if (!is_whole) damaged(record.name + " does not unpack to its size");
  return bytes;
}

// Where an entry's data begin; the local header must say what the directory says.
std::size_t data_of(const Bytes& zip, const Record& record) {
  const std::size_t at = record.offset;
  if (zip.u32(at) != kLocalMark || zip.u16(at + 8) != record.method)
    damaged(record.name + " has another header than the directory says");
  const std::size_t name_bytes = zip.u16(at + 26);
  const auto name = zip.part(at + kLocalBytes, name_bytes);
  const std::string_view text(reinterpret_cast<const char*>(name.data()), name.size());
  if (text != record.name) damaged(record.name + " has another name in its header");
  return at + kLocalBytes + name_bytes + zip.u16(at + 28);
}

std::vector<std::byte> content_of(const Bytes& zip, const Record& record) {
  const auto packed = zip.part(data_of(zip, record), record.packed);
  std::vector<std::byte> bytes;
  if (record.method == 8) {
    bytes = inflated(packed, record);
  } else if (packed.size() == record.unpacked) {
    bytes.assign(packed.begin(), packed.end());
  } else {
    damaged(record.name + " is stored with two sizes");
  }
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  if (crc32_z(0, data, bytes.size()) != record.checksum)
    damaged(record.name + " does not fit its checksum");
  return bytes;
}

}  // namespace

bool is_plain_name(std::string_view name) {
  if (name.empty() || name.size() > kLongestName) return false;
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-' || c == '/';
  };
  if (!std::all_of(name.begin(), name.end(), legal)) return false;
  for (;;) {
    const std::size_t slash = name.find('/');
    const std::string_view part = name.substr(0, slash);
    if (part.empty() || part.front() == '.') return false;
    if (slash == std::string_view::npos) return true;
    name.remove_prefix(slash + 1);
  }
}

std::vector<ArchiveEntry> unzip(std::span<const std::byte> bytes, const ArchiveLimits& limits) {
  if (bytes.size() > limits.packed_bytes)
    throw Error(ErrorCode::over_budget, "the archive has too many bytes");
  const Bytes zip(bytes);
  const std::size_t end = end_of(zip);
  const std::size_t count = zip.u16(end + 10);
  if (zip.u16(end + 4) != 0 || zip.u16(end + 8) != count) damaged("it is one of several disks");
  if (count > limits.entries)
    throw Error(ErrorCode::over_budget,
                "the archive has more than " + std::to_string(limits.entries) + " files");
  std::vector<Record> records;
  std::set<std::string> names;
  std::size_t total = 0;
  std::size_t at = zip.u32(end + 16);
  for (std::size_t i = 0; i < count; ++i) {
    Record record = record_at(zip, at);
    at += kEntryBytes + zip.u16(at + 28) + zip.u16(at + 30) + zip.u16(at + 32);
    check(record, limits);
    if (!names.insert(record.name).second) damaged(record.name + " is there twice");
    total += record.unpacked;
    if (total > limits.unpacked_bytes)
      throw Error(ErrorCode::over_budget, "the archive unpacks to too many bytes");
    records.push_back(std::move(record));
  }
  // Entries that share their bytes unpack to far more than the archive's size can mean.
  std::sort(records.begin(), records.end(),
            [](const Record& a, const Record& b) { return a.offset < b.offset; });
  std::size_t free_from = 0;
  for (const Record& record : records) {
    if (record.offset < free_from) damaged("its files overlap");
    free_from = data_of(zip, record) + record.packed;
  }
  std::vector<ArchiveEntry> entries;
  for (const Record& record : records) {
    if (!record.name.ends_with('/')) entries.push_back({record.name, content_of(zip, record)});
  }
  return entries;
}

}  // namespace fstop::api
