#include "server/channel.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/uio.h>

#include "core/error.h"

namespace fstop::server {
namespace {

struct Head {
  MessageKind kind = MessageKind::hello;
  std::uint32_t length = 0;  // of what follows
  std::uint64_t job = 0;
};

union Control {
  cmsghdr head;
  std::array<char, CMSG_SPACE(sizeof(int))> bytes;
};

// The first descriptor that came with a message; further ones are closed.
Descriptor descriptor_of(msghdr& message) {
  Descriptor first;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(part) + i * sizeof(int), sizeof number);
      Descriptor each(number);
      if (!first) first = std::move(each);
    }
  }
  return first;
}

}  // namespace

std::pair<Descriptor, Descriptor> Channel::pair() {
  std::array<int, 2> ends = {-1, -1};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw Error(ErrorCode::io_failure, std::string("socketpair: ") + std::strerror(errno));
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool Channel::send(MessageKind kind, std::uint64_t job, std::string_view body, int file,
                   bool may_wait) const {
  if (body.size() > kLargestBody)
    throw Error(ErrorCode::internal, "a message between processes is too long");
  Head head{.kind = kind, .length = static_cast<std::uint32_t>(body.size()), .job = job};
  std::array<iovec, 2> parts = {
      iovec{.iov_base = &head, .iov_len = sizeof head},
      iovec{.iov_base = const_cast<char*>(body.data()), .iov_len = body.size()}};
  msghdr message = {};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  Control control = {};
  if (file >= 0) {
    message.msg_control = control.bytes.data();
    message.msg_controllen = control.bytes.size();
    cmsghdr* part = CMSG_FIRSTHDR(&message);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof file);
    std::memcpy(CMSG_DATA(part), &file, sizeof file);
  }
  const int flags = MSG_NOSIGNAL | (may_wait ? 0 : MSG_DONTWAIT);
  for (;;) {
    if (::sendmsg(socket_.get(), &message, flags) >= 0) return true;
    if (errno != EINTR) return false;
  }
}

std::optional<Message> Channel::receive() const {
  Head head;
  std::string body(kLargestBody, '\0');
  std::array<iovec, 2> parts = {iovec{.iov_base = &head, .iov_len = sizeof head},
                                iovec{.iov_base = body.data(), .iov_len = body.size()}};
  Control control = {};
  msghdr message = {};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  message.msg_control = control.bytes.data();
  message.msg_controllen = control.bytes.size();
  ssize_t count = -1;
  do {
    count = ::recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC);
  } while (count < 0 && errno == EINTR);
  Descriptor file = count > 0 ? descriptor_of(message) : Descriptor();
  const bool is_whole = count >= static_cast<ssize_t>(sizeof head) &&
                        (message.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) == 0 &&
                        head.length == static_cast<std::size_t>(count) - sizeof head;
  if (!is_whole) return std::nullopt;
  body.resize(head.length);
  return Message{
      .kind = head.kind, .job = head.job, .body = std::move(body), .file = std::move(file)};
}

}  // namespace fstop::server
