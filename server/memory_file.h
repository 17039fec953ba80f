#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "server/byte_stream.h"
#include "server/descriptor.h"

namespace fstop::server {

/// Bytes that processes share: a file in memory without a name, which nobody can change any more.
class MemoryFile {
 public:
  MemoryFile() = default;
  /// Takes what another process sent.
  explicit MemoryFile(Descriptor file) : file_(std::move(file)) {}

  /// The bytes that `write` writes. Throws: Error{io_failure} where there is no memory for them.
  static MemoryFile written(const std::function<void(ByteWriter&)>& write);

  /// Calls `read` with all of it; the view ends with the call.
  /// Throws: Error{io_failure}, and what `read` throws.
  void read(const std::function<void(std::string_view)>& read) const;

  std::size_t size() const;
  int descriptor() const noexcept { return file_.get(); }

 private:
  Descriptor file_ = Descriptor();
};

}  // namespace fstop::server
