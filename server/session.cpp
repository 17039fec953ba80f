#include "server/session.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <limits>
#include <system_error>
#include <utility>

#include <boost/beast/core/string.hpp>

#include "api/problem.h"
#include "api/scene_upload.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kReadBytes = 16384;
constexpr int kClientGoneStatus = 499;
constexpr int kMostUploads = 4;

Refusal too_slow(const char* what) {
  return Refusal(http::status::request_timeout, "request-timeout",
                 std::string("the ") + what + " did not arrive in time")
      .closing();
}

// Room for the body of a PUT, which is held whole: taken before the first of its bytes is read.
class Room {
 public:
  Room(SessionContext::Incoming& incoming, const Request& request, const api::Limits& limits)
      : incoming_(incoming), is_content_(is_content_path(request.path)) {
    if (is_content_) {
      bytes_ = std::min(announced(request), limits.content_bytes);
      if (incoming.bytes + bytes_ > limits.incoming_bytes) throw too_many("1");
      incoming.bytes += bytes_;
    } else {
      if (incoming.uploads >= kMostUploads) throw too_many("5");
      ++incoming.uploads;
    }
  }
  ~Room() {
    if (is_content_) {
      incoming_.bytes -= bytes_;
    } else {
      --incoming_.uploads;
    }
  }
  Room(const Room&) = delete;
  Room& operator=(const Room&) = delete;

 private:
  static Refusal too_many(const char* seconds) {
    return Refusal(http::status::service_unavailable, "overloaded", "too many uploads at once")
        .with("Retry-After", seconds)
        .closing();
  }
  // In chunks it may be anything.
  static std::size_t announced(const Request& request) {
    const std::string_view text = request.header("Content-Length");
    std::size_t bytes = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bytes);
    const bool is_number = error == std::errc() && !text.empty();
    return is_number ? bytes : std::numeric_limits<std::size_t>::max();
  }

  SessionContext::Incoming& incoming_;
  bool is_content_;
  std::size_t bytes_ = 0;
};

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

Session::Session(asio::ip::tcp::socket socket, const SessionContext& context, std::uint64_t number)
    : connection_(std::move(socket)), context_(context), id_prefix_(std::to_string(number) + "-") {}

void Session::finish() {
  finishing_ = true;
  // A request that has come is answered, even if it is only about to be read.
  if (!busy_ && !connection_.has_waiting()) connection_.abort();
}

asio::awaitable<void> Session::run() {
  bool more = false;
  do {
    more = co_await exchange();
  } while (more && !finishing_);
}

// Reads one request and answers it. False: the connection has ended.
asio::awaitable<bool> Session::exchange() {
  Request request;
  RequestRecord record;
  request.id = record.id = id_prefix_ + std::to_string(++exchanges_);
  record.peer = connection_.peer();
  busy_ = !unread_.empty();
  if (!busy_) {
    const auto deadline = Clock::now() + context_.limits.idle_deadline;
    if (co_await connection_.read_some(unread_, kReadBytes, deadline) == 0) co_return false;
    busy_ = true;
  }
  const auto start = Clock::now();
  const std::optional<Reply> reply = co_await answer(request, record);
  bool sent = false;
  if (reply) {
    sent = co_await send(request, *reply);
    record.status = static_cast<int>(reply->status);
    record.reply_bytes = reply->bytes().size();
  } else {
    record.status = kClientGoneStatus;
  }
  record.method = request.method;
  record.path = request.path.empty() ? request.target : request.path;
  record.duration_ms = milliseconds_since(start);
  context_.log.request(record);
  context_.metrics.request(record.route, record.method, record.status, record.problem,
                           1e-3 * record.duration_ms);
  busy_ = false;
  if (sent && !request.keep_alive) co_await connection_.linger();
  co_return sent&& request.keep_alive;
}

// The reply to one request; none where the client is gone. Clears request.keep_alive where the
// connection must end with it. The one place where exceptions end.
asio::awaitable<std::optional<Reply>> Session::answer(Request& request, RequestRecord& record) {
  RequestParser parser(request,
                       {.max_head_bytes = context_.limits.header_bytes,
                        .max_fields = static_cast<std::size_t>(context_.limits.header_fields),
                        .max_body_bytes = context_.limits.body_bytes,
                        .max_upload_bytes = api::ArchiveLimits{}.packed_bytes,
                        .max_content_bytes = context_.limits.content_bytes});
  std::exception_ptr failure;
  std::optional<Reply> reply;
  try {
    if (!co_await read_head(parser)) co_return std::nullopt;
    record.trace = trace_of(request.header("traceparent"));
    reply = co_await dispatch(request, parser, record);
  } catch (const ClientGone&) {
    co_return std::nullopt;
  } catch (...) {
    failure = std::current_exception();
  }
  if (failure) reply = reply_of(failure, record);
  if (reply->close || finishing_ || has_unread_body(parser)) request.keep_alive = false;
  reply->set("Fstop-Request-Id", request.id);
  reply->set("traceparent", record.trace.traceparent());
  context_.access.open_to_origin(request, *reply);
  co_return reply;
}

bool Session::has_unread_body(const RequestParser& parser) const {
  return !parser.is_header_done() || !parser.is_done();
}

asio::awaitable<bool> Session::read_head(RequestParser& parser) {
  HeadReader reader(context_.limits.header_bytes);
  const auto deadline = Clock::now() + context_.limits.header_deadline;
  while (!reader.take(unread_, parser)) {
    if (co_await connection_.read_some(unread_, kReadBytes, deadline) == 0) {
      if (connection_.timed_out()) throw too_slow("header");
      co_return false;
    }
  }
  co_return true;
}

asio::awaitable<void> Session::read_body(const Request& request, RequestParser& parser) {
  const auto deadline = Clock::now() + context_.limits.body_deadline;
  const bool is_expected = !request.header("Expect").empty();
  if (is_expected && unread_.empty()) {
    constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
    if (!co_await connection_.write(kGoOn, {}, context_.limits.write_deadline)) throw ClientGone();
  }
  while (!take_body(unread_, parser)) {
    if (co_await connection_.read_some(unread_, kReadBytes, deadline) == 0) {
      if (connection_.timed_out()) throw too_slow("body");
      throw ClientGone();
    }
  }
}

asio::awaitable<Reply> Session::dispatch(Request& request, RequestParser& parser,
                                         RequestRecord& record) {
  resolve_target(request);
  context_.access.check(request);
  remove_signature(request);
  if (request.verb == http::verb::options) {
    const std::string allow = request.path == "*" ? "GET, HEAD, POST, PUT, DELETE, OPTIONS"
                                                  : context_.routes.allowed(request.path);
    if (allow.empty()) (void)context_.routes.match(request.verb, request.path);  // throws 404
    Reply reply{.status = http::status::no_content};
    reply.set("Allow", allow);
    co_return reply;
  }
  std::optional<Room> room;
  Routes::Match match = context_.routes.match(request.verb, request.path);
  record.route = match.route->pattern;
  if (request.verb == http::verb::post || request.verb == http::verb::put) {
    check_content(request);
    if (request.verb == http::verb::put) room.emplace(*context_.incoming, request, context_.limits);
    if (!parser.is_done()) co_await read_body(request, parser);
  } else if (!parser.is_done()) {
    throw Refusal(http::status::bad_request, "unexpected-body",
                  "a " + request.method + " request has no body here")
        .closing();
  }
  Call call{request, std::move(match.parameters), connection_, record};
  co_return co_await match.route->handler(call);
}

asio::awaitable<bool> Session::send(const Request& request, const Reply& reply) {
  const bool without_body = request.verb == http::verb::head;
  if (reply.next_piece && !without_body) co_return co_await send_pieces(request, reply);
  const std::string head = reply_head(reply, request.keep_alive);
  co_return co_await connection_.write(head, without_body ? std::span<const char>() : reply.bytes(),
                                       context_.limits.write_deadline);
}

// In chunks (RFC 9112 7.1), or up to the connection's end where it is to end. Once the head is out
// a failure can only end it.
asio::awaitable<bool> Session::send_pieces(const Request& request, const Reply& reply) {
  std::string head = reply_head(reply, request.keep_alive);
  try {
    for (;;) {
      std::string piece = co_await reply.next_piece();
      const bool is_last = piece.empty();
      if (request.keep_alive) {
        std::array<char, 24> size = {};
        std::snprintf(size.data(), size.size(), "%zx\r\n", piece.size());
        head += size.data();
        piece += "\r\n";
      }
      if (!co_await connection_.write(head, piece, context_.limits.write_deadline)) co_return false;
      if (is_last) co_return true;
      head.clear();
    }
  } catch (const std::exception&) {
    co_return false;
  }
}

Reply reply_of(const std::exception_ptr& failure, RequestRecord& record) {
  try {
    std::rethrow_exception(failure);
  } catch (const Refusal& refusal) {
    api::Problem problem =
        api::http_problem(static_cast<int>(refusal.status()), refusal.slug(), refusal.detail());
    problem.prediction = refusal.prediction();
    record.problem = refusal.slug();
    Reply reply = problem_reply(problem);
    for (const auto& [name, value] : refusal.headers()) reply.set(name, value);
    reply.close = refusal.close();
    return reply;
  } catch (const api::UploadRefused& refused) {
    record.problem = refused.problem().type.substr(refused.problem().type.rfind('/') + 1);
    return problem_reply(refused.problem());
  } catch (const std::exception& exception) {
    const api::Problem problem = api::problem(exception);
    record.error = exception.what();
    record.problem = problem.type.substr(problem.type.rfind('/') + 1);
    Reply reply = problem_reply(problem);
    if (problem.status == 503) reply.set("Retry-After", "1");
    return reply;
  }
}

}  // namespace fstop::server
