#include "server/content_folder.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <utility>

#include "api/render_id.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPrefix = 2;  // digits of a hash that name its folder

[[noreturn]] void fail(const fs::path& file, int error) {
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    throw Refusal(http::status::insufficient_storage, "storage-full",
                  "the disk that keeps results is full");
  }
  throw Error(ErrorCode::io_failure, "cannot write " + file.string() + ": " + std::strerror(error));
}

void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) fail(folder, errno);
  const int error = ::fsync(descriptor) == 0 || errno == EINVAL ? 0 : errno;
  ::close(descriptor);
  if (error != 0) fail(folder, error);
}

std::optional<std::string> text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  if (stream.bad()) throw Error(ErrorCode::io_failure, "cannot read " + file.string());
  return text;
}

bool is_half_written(const fs::path& file) {
  return file.filename().string().find(".part") != std::string::npos;
}

}  // namespace

ContentFolder::ContentFolder(fs::path folder) : folder_(std::move(folder)) {
  make_folder_durably(folder_);
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder_, error), end; !error && at != end;
       at.increment(error)) {
    if (at->is_regular_file() && is_half_written(at->path())) ::unlink(at->path().c_str());
  }
  if (error) throw Error(ErrorCode::io_failure, "cannot read " + folder_.string());
}

fs::path ContentFolder::path_of(std::string_view sha256) const {
  return folder_ / sha256.substr(0, kPrefix) / sha256.substr(std::min(kPrefix, sha256.size()));
}

bool ContentFolder::has(const CellFile& file) const {
  struct stat facts = {};
  return ::stat(path_of(file.sha256).c_str(), &facts) == 0 && S_ISREG(facts.st_mode) &&
         static_cast<std::uint64_t>(facts.st_size) == file.bytes;
}

bool ContentFolder::is_whole(const CellFile& file) {
  return has(file) && get(file.sha256).has_value();
}

std::string ContentFolder::put(std::string_view bytes) {
  std::string hash = api::sha256_hex(bytes);
  if (is_whole({.name = "", .sha256 = hash, .bytes = bytes.size()})) return hash;
  const fs::path file = path_of(hash);
  make_folder_durably(file.parent_path());
  write_durably(file.string(), bytes);
  return hash;
}

std::optional<std::string> ContentFolder::get(std::string_view sha256) {
  std::optional<std::string> bytes = text_of(path_of(sha256));
  if (bytes && api::sha256_hex(*bytes) != sha256) return std::nullopt;
  return bytes;
}

void ContentFolder::remove(std::string_view sha256) noexcept {
  std::error_code ignored;
  fs::remove(path_of(sha256), ignored);
}

void make_folder_durably(const fs::path& folder) {
  struct stat facts = {};
  if (::stat(folder.c_str(), &facts) == 0) {
    if (!S_ISDIR(facts.st_mode)) fail(folder, ENOTDIR);
    return;
  }
  const fs::path above = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  if (above != folder) make_folder_durably(above);
  if (::mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) fail(folder, errno);
  flush_folder(above);
}

void link_durably(const fs::path& file, const fs::path& name) {
  make_folder_durably(name.parent_path());
  const fs::path part = name.string() + ".part" + std::to_string(::getpid()) + "-" +
                        std::to_string(::syscall(SYS_gettid));
  ::unlink(part.c_str());
  if (::link(file.c_str(), part.c_str()) != 0) {
    if (errno != EPERM && errno != EOPNOTSUPP && errno != EMLINK && errno != EXDEV)
      fail(name, errno);
    const std::optional<std::string> bytes = text_of(file);
    if (!bytes) fail(file, ENOENT);
    return write_durably(name.string(), *bytes);
  }
  if (::rename(part.c_str(), name.c_str()) != 0) {
    const int error = errno;
    ::unlink(part.c_str());
    fail(name, error);
  }
  ::unlink(part.c_str());  // rename() leaves it where both are names of one file already
  flush_folder(name.parent_path());
}

}  // namespace fstop::server
