#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/system/error_code.hpp>

namespace fstop::server {

using Clock = std::chrono::steady_clock;

/// A socket whose every wait ends by a deadline. All of it runs on the I/O thread.
class Connection {
 public:
  explicit Connection(boost::asio::ip::tcp::socket socket);

  /// Appends what has come to `buffer`, at most `max_bytes`. Bytes read; 0 at the end of the
  /// stream, on an error or at the deadline: `timed_out()` tells.
  boost::asio::awaitable<std::size_t> read_some(std::string& buffer, std::size_t max_bytes,
                                                Clock::time_point deadline);
  bool timed_out() const noexcept { return timed_out_; }

  /// All of `head`, then all of `body`. False if the peer does not take the next bytes within
  /// `patience`, or takes all of them slower than kSlowestWrite.
  boost::asio::awaitable<bool> write(std::string_view head, std::span<const char> body,
                                     Clock::duration patience);

  /// Returns once the peer has reset the connection or closed it, be it only its own half. Bytes
  /// that come meanwhile stay unread, so a client cannot fill our memory while it waits.
  boost::asio::awaitable<void> peer_gone();

  /// Says that no more will be sent and reads what still comes for a moment, so that the peer gets
  /// our last reply instead of a reset.
  boost::asio::awaitable<void> linger();

  /// Ends every wait; the session then ends by itself.
  /// Whether bytes of the peer have come that nobody has read.
  bool has_waiting() const;
  void abort() noexcept;

  std::string peer() const { return peer_; }

  static constexpr double kSlowestWrite = 64.0 * 1024.0;  // bytes per second, over a whole reply

 private:
  boost::asio::ip::tcp::socket socket_;
  std::string peer_;
  bool timed_out_ = false;
};

}  // namespace fstop::server
