#include "server/connection.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <tuple>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::experimental::awaitable_operators::operator||;
constexpr auto kNoThrow = asio::as_tuple(asio::use_awaitable);

constexpr std::size_t kPieceBytes = std::size_t{256} << 10;
constexpr int kPiecesAtOnce = 4;
constexpr auto kLingerTime = std::chrono::seconds(2);
constexpr std::size_t kLingerBytes = std::size_t{4} << 20;
constexpr auto kLookAgain = std::chrono::milliseconds(20);
// A peer that vanished without a word: unacknowledged data ends the connection after this.
constexpr unsigned kUserTimeoutMs = 30'000;

asio::awaitable<void> sleep_until(Clock::time_point time) {
  asio::steady_timer timer(co_await asio::this_coro::executor, time);
  co_await timer.async_wait(kNoThrow);
}

}  // namespace

Connection::Connection(asio::ip::tcp::socket socket) : socket_(std::move(socket)) {
  boost::system::error_code ec;
  socket_.set_option(asio::ip::tcp::no_delay(true), ec);
  socket_.non_blocking(true, ec);
  using UserTimeout = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_USER_TIMEOUT>;
  socket_.set_option(UserTimeout(static_cast<int>(kUserTimeoutMs)), ec);
  socket_.non_blocking(true, ec);
  const auto endpoint = socket_.remote_endpoint(ec);
  if (!ec) peer_ = endpoint.address().to_string();
}

asio::awaitable<std::size_t> Connection::read_some(std::string& buffer, std::size_t max_bytes,
                                                   Clock::time_point deadline) {
  timed_out_ = false;
  std::array<char, 16384> bytes;  // NOLINT(cppcoreguidelines-pro-type-member-init): read into
  const auto space = asio::buffer(bytes.data(), std::min(bytes.size(), max_bytes));
  for (;;) {
    // Bytes stay with the kernel until they are taken here: has_waiting() tells of all of them.
    const auto outcome = co_await (socket_.async_wait(asio::ip::tcp::socket::wait_read, kNoThrow) ||
                                   sleep_until(deadline));
    if (outcome.index() == 1) {
      timed_out_ = true;
      co_return 0;
    }
    boost::system::error_code ec;
    const std::size_t count = socket_.read_some(space, ec);
    if (ec == asio::error::would_block) continue;
    buffer.append(bytes.data(), count);
    co_return ec ? 0 : count;
  }
}

asio::awaitable<bool> Connection::write(std::string_view head, std::span<const char> body,
                                        Clock::duration patience) {
  const double allowed_s = static_cast<double>(head.size() + body.size()) / kSlowestWrite;
  const auto last =
      Clock::now() + patience +
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(allowed_s));
  int at_once = 0;
  while (!head.empty() || !body.empty()) {
    const std::array<asio::const_buffer, 2> pieces = {
        asio::buffer(head.data(), head.size()),
        asio::buffer(body.data(), std::min(body.size(), kPieceBytes))};
    // The kernel mostly has room: only what it does not take at once is waited for. A fast reader
    // of much must let others have their turn, too.
    boost::system::error_code ec = asio::error::would_block;
    std::size_t count = 0;
    if (++at_once <= kPiecesAtOnce) count = socket_.write_some(pieces, ec);
    if (ec == asio::error::would_block || ec == asio::error::interrupted) {
      at_once = 0;
      const auto deadline = std::min(last, Clock::now() + patience);
      const auto outcome =
          co_await (socket_.async_write_some(pieces, kNoThrow) || sleep_until(deadline));
      if (outcome.index() == 1) co_return false;
      std::tie(ec, count) = std::get<0>(outcome);
    }
    if (ec) co_return false;
    const std::size_t of_head = std::min(count, head.size());
    head.remove_prefix(of_head);
    body = body.subspan(count - of_head);
  }
  co_return true;
}

asio::awaitable<void> Connection::peer_gone() {
  for (;;) {
    const auto [ec] = co_await socket_.async_wait(asio::ip::tcp::socket::wait_read, kNoThrow);
    if (ec) co_return;
    char byte = 0;
    const auto seen = ::recv(socket_.native_handle(), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (seen == 0 || (seen < 0 && errno != EAGAIN && errno != EINTR)) co_return;
    // A pipelined request waits before whatever comes: ask the kernel instead.
    tcp_info info = {};
    socklen_t size = sizeof info;
    if (::getsockopt(socket_.native_handle(), IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
        info.tcpi_state != TCP_ESTABLISHED) {
      co_return;
    }
    co_await sleep_until(Clock::now() + kLookAgain);
  }
}

asio::awaitable<void> Connection::linger() {
  boost::system::error_code ec;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ec);
  const auto deadline = Clock::now() + kLingerTime;
  std::string discarded;
  for (std::size_t total = 0; total < kLingerBytes;) {
    const std::size_t count = co_await read_some(discarded, kPieceBytes, deadline);
    if (count == 0) break;
    total += count;
    discarded.clear();
  }
}

bool Connection::has_waiting() const {
  boost::system::error_code ec;
  return socket_.available(ec) > 0;
}

void Connection::abort() noexcept {
  boost::system::error_code ec;
  socket_.close(ec);
}

}  // namespace fstop::server
