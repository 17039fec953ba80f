#include "server/listener.h"

#include <chrono>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/error.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
constexpr auto kNoThrow = asio::as_tuple(asio::use_awaitable);

constexpr auto kAcceptPause = std::chrono::milliseconds(100);
constexpr int kMostTurnedAway = 64;  // beyond it connections are closed without a word

int open_spare() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

Reply overloaded() {
  Reply reply =
      problem_reply(503, "overloaded", "as many connections are open as the server takes");
  reply.set("Retry-After", "1");
  return reply;
}

}  // namespace

Listener::Listener(asio::io_context& context, const std::string& address, std::uint16_t port,
                   const SessionContext& sessions)
    : context_(context),
      acceptor_(context),
      session_context_(sessions),
      spare_descriptor_(open_spare()) {
  try {
    const tcp::endpoint endpoint(asio::ip::make_address(address), port);
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
  } catch (const boost::system::system_error& error) {
    throw Error(ErrorCode::io_failure, "cannot listen on " + address + " port " +
                                           std::to_string(port) + ": " + error.code().message());
  }
}

Listener::~Listener() {
  if (spare_descriptor_ >= 0) ::close(spare_descriptor_);
}

std::uint16_t Listener::port() const { return acceptor_.local_endpoint().port(); }

void Listener::start() { asio::co_spawn(context_, accept_all(), asio::detached); }

asio::awaitable<void> Listener::accept_all() {
  while (acceptor_.is_open()) {
    auto [ec, socket] = co_await acceptor_.async_accept(kNoThrow);
    if (ec) {
      if (!acceptor_.is_open()) co_return;
      if (ec == asio::error::no_descriptors) turn_away_without_descriptor();
      asio::steady_timer pause(context_, kAcceptPause);
      co_await pause.async_wait(kNoThrow);
      continue;
    }
    try {
      admit(std::move(socket));
    } catch (const std::exception& exception) {  // no memory for one more session
      session_context_.log.warning("connection_dropped", {{"error", exception.what()}});
    }
  }
}

void Listener::admit(tcp::socket socket) {
  const bool is_full = static_cast<int>(sessions_.size()) >= session_context_.limits.connections;
  if (!is_full) {
    asio::co_spawn(context_, serve(std::move(socket)), asio::detached);
  } else if (turned_away_ < kMostTurnedAway) {
    asio::co_spawn(context_, turn_away(std::move(socket)), asio::detached);
  }
}

asio::awaitable<void> Listener::serve(tcp::socket socket) {
  Session session(std::move(socket), session_context_, ++accepted_);
  sessions_.insert(&session);
  ++open_;
  if (finishing_) session.finish();
  try {
    co_await session.run();
  } catch (const std::exception& exception) {
    session_context_.log.warning("session_failed", {{"error", exception.what()}});
  }
  sessions_.erase(&session);
  --open_;
  if (sessions_.empty() && drained_) drained_();
}

asio::awaitable<void> Listener::turn_away(tcp::socket socket) {
  ++turned_away_;
  Connection connection(std::move(socket));
  const Reply reply = overloaded();
  const std::string head = reply_head(reply, false);
  const bool sent =
      co_await connection.write(head, reply.bytes(), session_context_.limits.write_deadline);
  if (sent) co_await connection.linger();
  --turned_away_;
}

// No descriptor is left for the next connection, which would wait for ever: the spare one takes it
// and closes it.
void Listener::turn_away_without_descriptor() {
  session_context_.log.warning("out_of_descriptors");
  ::close(spare_descriptor_);
  const int descriptor = ::accept4(acceptor_.native_handle(), nullptr, nullptr, SOCK_CLOEXEC);
  if (descriptor >= 0) ::close(descriptor);
  spare_descriptor_ = open_spare();
}

// To the peers they are connected, and may have asked already: closing would reset them.
void Listener::admit_backlog() {
  boost::system::error_code ec;
  acceptor_.non_blocking(true, ec);
  while (!ec) {
    tcp::socket socket(context_);
    acceptor_.accept(socket, ec);
    if (!ec) admit(std::move(socket));
  }
}

void Listener::finish(std::function<void()> drained) {
  finishing_ = true;
  admit_backlog();
  boost::system::error_code ec;
  acceptor_.close(ec);
  // By then the sessions of the last connections have begun.
  asio::post(context_, [this, last = std::move(drained)] {
    drained_ = last;
    for (Session* session : sessions_) session->finish();
    if (sessions_.empty()) drained_();
  });
}

void Listener::abort_sessions() {
  for (Session* session : sessions_) session->abort();
}

}  // namespace fstop::server
