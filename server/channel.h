#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/descriptor.h"

namespace fstop::server {

/// What the server and a worker process say to each other.
enum class MessageKind : std::uint32_t {
  hello,     // worker: it is there
  job,       // server: make this photograph; its file is the scene
  scene,     // server: there will be jobs with this scene, its file; the hash is the body
  cancel,    // server: stop this job
  progress,  // worker: the fraction that is done
  preview,   // worker: its file is a small picture so far
  done,      // worker: its file is the photograph
  failed     // worker: why there is none
};

struct Message {
  MessageKind kind = MessageKind::hello;
  std::uint64_t job = 0;
  std::string body = {};
  Descriptor file = Descriptor();
};

/// One end of a socket between two processes that keeps messages whole, each with at most one
/// descriptor. May be sent on by several threads and received on by one.
class Channel {
 public:
  explicit Channel(Descriptor socket) : socket_(std::move(socket)) {}
  /// Both ends of a new one. Throws: Error{io_failure}.
  static std::pair<Descriptor, Descriptor> pair();

  /// Whether it was sent: false once the other end is gone. `may_wait` false: also where that would
  /// take time.
  bool send(MessageKind kind, std::uint64_t job, std::string_view body = {}, int file = -1,
            bool may_wait = true) const;
  /// Waits for the next message; none once the other end is gone, or sends what is no message.
  std::optional<Message> receive() const;
  int descriptor() const noexcept { return socket_.get(); }

  static constexpr std::size_t kLargestBody = std::size_t{64} << 10;

 private:
  Descriptor socket_;
};

}  // namespace fstop::server
