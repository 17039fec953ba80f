#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "core/error.h"
#include "server/commands.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

bool is_out_of_space(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

[[noreturn]] void fail(const std::string& file, int error) {
  throw Error(ErrorCode::io_failure, "cannot write " + file + ": " + std::strerror(error));
}

// Write, flush to the disk, close: 0 or the error. Disks that are full may say so only here.
int written(int descriptor, std::string_view bytes) {
  int error = 0;
  while (error == 0 && !bytes.empty()) {
    const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
    if (count >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  // Pipes and devices cannot be flushed.
  if (error == 0 && ::fsync(descriptor) != 0 && errno != EINVAL && errno != EROFS) error = errno;
  if (::close(descriptor) != 0 && error == 0) error = errno;
  return error;
}

bool is_device(const std::string& file) {
  struct stat facts = {};
  return ::stat(file.c_str(), &facts) == 0 && !S_ISREG(facts.st_mode);
}

// 0 or the error: a file of this name, whole and on the disk.
int replaced(const std::string& file, std::string_view bytes) {
  // Two threads may write the same file: each its own beside it.
  const std::string part =
      file + ".part" + std::to_string(::getpid()) + "-" + std::to_string(::syscall(SYS_gettid));
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return errno;
  int error = written(descriptor, bytes);
  if (error == 0 && ::rename(part.c_str(), file.c_str()) != 0) error = errno;
  if (error != 0) ::unlink(part.c_str());
  return error;
}

}  // namespace

std::string text_of(const std::string& file, std::size_t max_bytes) {
  std::ifstream stream;
  if (file != "-") {
    stream.open(file, std::ios::binary);
    if (!stream) throw Error(ErrorCode::not_found, "cannot open " + file);
  }
  std::istream& source = file == "-" ? std::cin : stream;
  std::string text(max_bytes + 1, '\0');
  source.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (source.bad()) throw Error(ErrorCode::io_failure, "cannot read " + file);
  text.resize(static_cast<std::size_t>(source.gcount()));
  if (text.size() > max_bytes) {
    throw Error(ErrorCode::over_budget,
                file + " has more than " + std::to_string(max_bytes) + " bytes");
  }
  return text;
}

void write_file(const std::string& file, std::string_view bytes) {
  if (is_device(file)) {  // such as /dev/full or a pipe: nothing to rename
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) fail(file, errno);
    if (const int error = written(descriptor, bytes)) fail(file, error);
    return;
  }
  if (const int error = replaced(file, bytes)) fail(file, error);
}

void write_durably(const std::string& file, std::string_view bytes) {
  int error = replaced(file, bytes);
  if (error == 0) {  // the name, too, must outlive a loss of power
    const std::string folder = std::filesystem::path(file).parent_path().string();
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor >= 0) {
      ::fsync(descriptor);
      ::close(descriptor);
    }
    return;
  }
  if (!is_out_of_space(error)) fail(file, error);
  throw Refusal(http::status::insufficient_storage, "storage-full",
                "the disk that keeps results is full");
}

}  // namespace fstop::server
