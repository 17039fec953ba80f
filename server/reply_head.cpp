#include "server/reply_head.h"

#include <array>
#include <ctime>
#include <string>
#include <utility>

#include <boost/beast/http/status.hpp>

#include "api/problem.h"
#include "api/render_id.h"

namespace fstop::server {
namespace {

// The time as RFC 9110 5.6.7 writes it, made once a second; the process keeps the C locale.
std::string_view http_date() {
  thread_local std::time_t made_at = -1;
  thread_local std::array<char, 64> text = {};
  thread_local std::size_t length = 0;
  if (const std::time_t now = std::time(nullptr); now != made_at) {
    std::tm parts = {};
    gmtime_r(&now, &parts);
    length = std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &parts);
    made_at = now;
  }
  return {text.data(), length};
}

bool has_body(http::status status) {
  return status != http::status::no_content && status != http::status::not_modified;
}

}  // namespace

std::string reply_head(const Reply& reply, bool keep_alive) {
  std::string head;
  head.reserve(1024);
  const auto line = [&](std::string_view name, std::string_view value) {
    head.append(name).append(": ").append(value).append("\r\n");
  };
  const auto reason = http::obsolete_reason(reply.status);
  head.append("HTTP/1.1 ").append(std::to_string(static_cast<unsigned>(reply.status))).append(" ");
  head.append(reason.data(), reason.size()).append("\r\n");
  line("Date", http_date());
  line("Server", api::engine_version());
  line("X-Content-Type-Options", "nosniff");
  for (const auto& [name, value] : reply.headers) line(name, value);
  if (reply.next_piece) {
    // Else the connection's end is the body's: HTTP/1.0 has no chunks.
    if (keep_alive) line("Transfer-Encoding", "chunked");
  } else if (has_body(reply.status)) {
    line("Content-Length", std::to_string(reply.bytes().size()));
  }
  if (!keep_alive) line("Connection", "close");
  return head.append("\r\n");
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
