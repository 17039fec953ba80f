#include "server/reply_head.h"

#include <array>
#include <ctime>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/buffers_range.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/serializer.hpp>

#include "api/problem.h"
#include "api/render_id.h"

namespace fstop::server {
namespace {

namespace beast = boost::beast;

beast::string_view view(std::string_view text) { return {text.data(), text.size()}; }

// The time as RFC 9110 5.6.7 writes it; the process keeps the C locale.
std::string http_date() {
  const std::time_t now = std::time(nullptr);
  std::tm parts = {};
  gmtime_r(&now, &parts);
  std::array<char, 64> text = {};
  const std::size_t length =
      std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts);
  return {text.data(), length};
}

std::string serialized(const http::response<http::empty_body>& response) {
  http::response_serializer<http::empty_body> serializer(response);
  serializer.split(true);  // the header alone, without the last chunk of an empty body
  std::string head;
  beast::error_code ec;
  while (!serializer.is_header_done() && !ec) {
    serializer.next(ec, [&](beast::error_code&, const auto& buffers) {
      std::size_t bytes = 0;
      for (const auto buffer : beast::buffers_range_ref(buffers)) {
        head.append(static_cast<const char*>(buffer.data()), buffer.size());
        bytes += buffer.size();
      }
      serializer.consume(bytes);
    });
  }
  return head;
}

bool has_body(http::status status) {
  return status != http::status::no_content && status != http::status::not_modified;
}

}  // namespace

std::string reply_head(const Reply& reply, bool keep_alive) {
  http::response<http::empty_body> response(reply.status, 11);
  response.set(http::field::date, view(http_date()));
  response.set(http::field::server, view(api::engine_version()));
  response.set("X-Content-Type-Options", "nosniff");
  for (const auto& [name, value] : reply.headers) response.insert(view(name), view(value));
  if (reply.next_piece) {
    response.chunked(
        keep_alive);  // else the connection's end is the body's: HTTP/1.0 has no chunks
  } else if (has_body(reply.status)) {
    response.content_length(reply.bytes().size());
  }
  if (!keep_alive) response.set(http::field::connection, "close");
  return serialized(response);
}

Reply problem_reply(int status, std::string_view slug, const std::string& detail) {
  return problem_reply(api::http_problem(status, slug, detail));
}

Reply problem_reply(const api::Problem& problem) {
  Reply reply{.status = http::int_to_status(static_cast<unsigned>(problem.status)),
              .body = api::to_json(problem)};
  reply.set("Content-Type", "application/problem+json");
  reply.set("Cache-Control", "no-store");
  return reply;
}

std::string etag_of(std::string_view hash) {
  std::string tag(1, '"');
  tag.append(hash).push_back('"');
  return tag;
}

bool is_known_to_client(const Request& request, std::string_view etag) {
  std::string_view list = request.header("If-None-Match");
  while (!list.empty()) {
    const std::size_t comma = list.find(',');  // our tags hold no commas
    std::string_view tag = list.substr(0, comma);
    list = comma == std::string_view::npos ? std::string_view() : list.substr(comma + 1);
    while (!tag.empty() && tag.front() == ' ') tag.remove_prefix(1);
    while (!tag.empty() && tag.back() == ' ') tag.remove_suffix(1);
    if (tag.starts_with("W/")) tag.remove_prefix(2);  // the comparison is weak: RFC 9110 13.1.2
    if (tag == etag || tag == "*") return true;
  }
  return false;
}

Reply tagged_reply(const Request& request, std::string media_type, const std::string& etag,
                   std::variant<std::string, SharedBytes> body) {
  Reply reply;
  reply.set("ETag", etag);
  if (is_known_to_client(request, etag)) {
    reply.status = http::status::not_modified;
    return reply;
  }
  reply.set("Content-Type", std::move(media_type));
  reply.body = std::move(body);
  return reply;
}

}  // namespace fstop::server
