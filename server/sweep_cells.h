#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace fstop::server {

/// One cell of a sweep: all that whoever makes its files must know.
struct SweepCell {
  std::string sweep = {};  // id of the sweep: the hash of its recipe
  std::uint32_t index = 0;
  std::string request = {};  // a whole render request, JSON
};

/// A file made for a cell. Its bytes lie in a content store.
struct CellFile {
  std::string name = {};    // within the cell: "image.png", "layers.exr"
  std::string sha256 = {};  // of its bytes, 64 lowercase hexadecimal digits
  std::uint64_t bytes = 0;
};

/// What became of a cell. Says nothing that depends on when, where and how often it was tried.
struct CellOutcome {
  std::uint32_t index = 0;
  std::string render_id = {};
  std::vector<CellFile> files = {};
  std::string report = {};   // JSON, without times
  std::string problem = {};  // of a cell that cannot be made: RFC 9457, JSON; then no files
};

/// Files by the hash of their bytes. Putting what is there already changes nothing. Any thread.
class ContentStore {
 public:
  virtual ~ContentStore() = default;
  /// Returns the hash once the bytes are durable.
  /// Throws: Refusal 507 where there is no room, Error{io_failure}.
  virtual std::string put(std::string_view bytes) = 0;
  /// Nothing if it is not there or not whole. Throws: Error{io_failure}.
  virtual std::optional<std::string> get(std::string_view sha256) = 0;
  /// Frees the room of bytes that nobody needs any more, where this store can.
  virtual void remove(std::string_view /*sha256*/) noexcept {}
};

/// Makes cells: with this process's threads, or by workers elsewhere.
class CellMaker {
 public:
  struct Listener {
    /// A cell's outcome, its files durable; called for one cell at a time, once for each.
    std::function<void(CellOutcome)> done;
    /// What the sweep waits for ("disk space", "the queue at nats://...", "workers"); empty:
    /// nothing.
    std::function<void(std::string_view)> waiting;
  };

  virtual ~CellMaker() = default;
  /// Returns when every cell has its outcome, or soon after `stop` is requested.
  virtual void make(const std::vector<SweepCell>& cells, const Listener& listener,
                    std::stop_token stop) = 0;
};

}  // namespace fstop::server
