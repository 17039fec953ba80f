#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "api/limits.h"
#include "server/access.h"
#include "server/connection.h"
#include "server/log.h"
#include "server/metrics.h"
#include "server/request_parser.h"
#include "server/routes.h"

namespace fstop::server {

/// What all sessions of a server share.
struct SessionContext {
  const api::Limits& limits;
  const Routes& routes;
  const AccessRules& access;
  Log& log;
  Metrics& metrics;
  // Being read, or worked on, now.
  struct Incoming {
    int uploads = 0;
    std::size_t bytes = 0;  // of files by their hash
  };
  std::shared_ptr<Incoming> incoming = std::make_shared<Incoming>();
};

/// One connection: its requests one after the other, each answered before the next is read.
/// Whatever goes wrong in it ends this session alone.
class Session {
 public:
  Session(boost::asio::ip::tcp::socket socket, const SessionContext& context, std::uint64_t number);

  boost::asio::awaitable<void> run();
  /// Ends now if no request is under way, else after its reply.
  void finish();
  void abort() noexcept { connection_.abort(); }

 private:
  boost::asio::awaitable<bool> exchange();
  boost::asio::awaitable<bool> read_head(RequestParser& parser);
  boost::asio::awaitable<void> read_body(const Request& request, RequestParser& parser);
  boost::asio::awaitable<std::optional<Reply>> answer(Request& request, RequestRecord& record);
  boost::asio::awaitable<Reply> dispatch(Request& request, RequestParser& parser,
                                         RequestRecord& record);
  boost::asio::awaitable<bool> send(const Request& request, const Reply& reply);
  boost::asio::awaitable<bool> send_pieces(const Request& request, const Reply& reply);
  bool has_unread_body(const RequestParser& parser) const;

  Connection connection_;
  SessionContext context_;
  std::string id_prefix_;
  std::uint64_t exchanges_ = 0;
  std::string unread_ = {};  // bytes that came and belong to what follows
  bool busy_ = false;        // between the first byte of a request and the last of its reply
  bool finishing_ = false;
};

/// The problem document that `failure` becomes; `record` notes its slug and its cause.
Reply reply_of(const std::exception_ptr& failure, RequestRecord& record);

}  // namespace fstop::server
