#include "server/memory_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>

#include "core/error.h"

namespace fstop::server {
namespace {

constexpr std::size_t kBuffered = std::size_t{64} << 10;

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorCode::io_failure, std::string(what) + ": " + std::strerror(errno));
}

void write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("memory shared between processes");
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

// Pages of a file in memory, as long as it lives.
class Mapping {
 public:
  Mapping(int file, std::size_t size) : size_(size) {
    // Read once from end to end: all pages at once cost less than one by one.
    if (size > 0) start_ = ::mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, file, 0);
    if (start_ == MAP_FAILED) fail("mmap");
  }
  ~Mapping() {
    if (start_ != nullptr) ::munmap(start_, size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  std::string_view bytes() const { return {static_cast<const char*>(start_), size_}; }

 private:
  void* start_ = nullptr;
  std::size_t size_;
};

}  // namespace

MemoryFile MemoryFile::written(const std::function<void(ByteWriter&)>& write) {
  MemoryFile made(Descriptor(::memfd_create("fstop", MFD_CLOEXEC | MFD_ALLOW_SEALING)));
  if (!made.file_) fail("memfd_create");
  const int file = made.file_.get();
  std::string buffer;
  const auto flush = [&] {
    write_all(file, buffer);
    buffer.clear();
  };
  ByteWriter writer([&](std::string_view bytes) {
    if (buffer.size() + bytes.size() > kBuffered) flush();
    if (bytes.size() > kBuffered) return write_all(file, bytes);
    buffer += bytes;
  });
  write(writer);
  flush();
  if (::fcntl(file, F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) != 0)
    fail("F_ADD_SEALS");
  return made;
}

void MemoryFile::read(const std::function<void(std::string_view)>& read) const {
  // Without the seals the other side could change or cut what is being read.
  constexpr int kNeeded = F_SEAL_WRITE | F_SEAL_SHRINK;
  const int seals = ::fcntl(file_.get(), F_GET_SEALS);
  if (seals < 0 || (seals & kNeeded) != kNeeded)
    throw Error(ErrorCode::io_failure, "another process sent memory that may still change");
  const Mapping mapping(file_.get(), size());
  read(mapping.bytes());
}

std::size_t MemoryFile::size() const {
  struct stat status = {};
  if (::fstat(file_.get(), &status) != 0) fail("fstat");
  return static_cast<std::size_t>(status.st_size);
}

}  // namespace fstop::server
