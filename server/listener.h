#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <unordered_set>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "server/session.h"

namespace fstop::server {

/// Accepts connections, up to a bound, and keeps track of their sessions.
class Listener {
 public:
  /// Throws: Error{io_failure} if the address cannot be listened on.
  Listener(boost::asio::io_context& context, const std::string& address, std::uint16_t port,
           const SessionContext& sessions);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  std::uint16_t port() const;
  void start();
  /// No more connections than there are by now; sessions end after the reply they are at, or the
  /// one to what they were sent. `drained` is called once none is left.
  void finish(std::function<void()> drained);
  /// Ends all sessions at once.
  void abort_sessions();
  /// From any thread.
  int sessions() const noexcept { return open_; }

 private:
  boost::asio::awaitable<void> accept_all();
  void admit(boost::asio::ip::tcp::socket socket);
  void admit_backlog();
  boost::asio::awaitable<void> serve(boost::asio::ip::tcp::socket socket);
  boost::asio::awaitable<void> turn_away(boost::asio::ip::tcp::socket socket);
  void turn_away_without_descriptor();

  boost::asio::io_context& context_;
  boost::asio::ip::tcp::acceptor acceptor_;
  SessionContext session_context_;
  std::unordered_set<Session*> sessions_ = {};
  std::function<void()> drained_ = {};
  std::uint64_t accepted_ = 0;
  std::atomic<int> open_ = 0;  // sessions_.size()
  bool finishing_ = false;
  int turned_away_ = 0;  // connections that are being told so
  int spare_descriptor_ = -1;
};

}  // namespace fstop::server
