#include "server/request_parser.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/url/parse.hpp>

#include "server/bad_framing.h"
#include "server/routes.h"

namespace fstop::server {
namespace {

namespace beast = boost::beast;

constexpr std::size_t kMaxExtensionBytes = 8192;

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

bool all_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// host [":" port] of RFC 9110 7.2: no user, no empty host.
bool is_host(std::string_view text) {
  if (text.empty() || text.size() > 255) return false;
  const auto authority =
      boost::urls::parse_authority(boost::core::string_view(text.data(), text.size()));
  if (!authority || authority->has_userinfo() || authority->encoded_host().empty()) return false;
  if (!authority->has_port() || authority->port().empty()) return true;
  // Boost's number of a port beyond 16 bits is not 0.
  const std::string_view digits(authority->port().data(), authority->port().size());
  unsigned port = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  return error == std::errc() && end == digits.data() + digits.size() && port > 0 && port <= 65535;
}

// What an error of Beast's parser means to the client.
Refusal refusal_of(const beast::error_code& ec) {
  if (ec == http::error::body_limit) {
    return Refusal(http::status::payload_too_large, "body-too-large",
                   "the body is larger than this server reads")
        .closing();
  }
  return bad_framing("not a well-formed HTTP request: " + ec.message());
}

// Beast has one error for other versions of HTTP and for what is none.
void refuse_other_version(std::string_view request_line) {
  const std::string_view version = request_line.substr(request_line.rfind(' ') + 1);
  if (version.size() != 8 || !version.starts_with("HTTP/") || version[6] != '.') return;
  if (version == "HTTP/1.1" || version == "HTTP/1.0") return;
  throw Refusal(http::status::http_version_not_supported, "bad-version",
                "this server speaks HTTP/1.1 and HTTP/1.0")
      .closing();
}

}  // namespace

std::optional<std::size_t> HeadScanner::scan(std::string_view bytes) {
  for (; position_ < bytes.size(); ++position_) {
    if (position_ >= max_bytes_) {
      if (line_start_ == 0) {
        throw Refusal(http::status::uri_too_long, "target-too-long",
                      "the request line is longer than " + std::to_string(max_bytes_) + " bytes")
            .closing();
      }
      throw Refusal(http::status::request_header_fields_too_large, "headers-too-large",
                    "the header is longer than " + std::to_string(max_bytes_) + " bytes")
          .closing();
    }
    const char c = bytes[position_];
    if (c == '\0') throw bad_framing("a NUL byte in the header");
    const bool after_cr = position_ > line_start_ && bytes[position_ - 1] == '\r';
    if (after_cr != (c == '\n')) throw bad_framing("header lines end with CR LF");
    if (position_ == line_start_ && (c == ' ' || c == '\t'))
      throw bad_framing("a header line begins with white space");
    if (c != '\n') continue;
    if (position_ - line_start_ == 1) return position_ + 1;
    line_start_ = position_ + 1;
  }
  return std::nullopt;
}

RequestParser::RequestParser(Request& request, const ParserLimits& limits)
    : request_(request), limits_(limits) {
  eager(true);
  body_limit(limits.max_body_bytes);
  // The scanner has judged the size already; Beast counts request line and fields apart.
  header_limit(static_cast<std::uint32_t>(limits.max_head_bytes + 4));
}

std::size_t RequestParser::feed(std::string_view bytes) {
  beast::error_code ec;
  const std::size_t used = put(boost::asio::const_buffer(bytes.data(), bytes.size()), ec);
  if (refusal_) throw *refusal_;
  if (ec && ec != http::error::need_more) throw refusal_of(ec);
  return used;
}

void RequestParser::read_head(std::string_view head) {
  refuse_other_version(head.substr(0, head.find('\r')));
  // Eager parsing of exactly the head stops behind it: there is nothing more to take.
  feed(head);
  if (!is_header_done()) throw bad_framing("not a well-formed HTTP request");
  request_.keep_alive = keep_alive() && !http_1_0_;
}

std::size_t RequestParser::read_body(std::string_view bytes) {
  if (!chunked()) return feed(bytes);
  // A line or the data of a chunk at a time: the first refusal of a body is the same however its
  // bytes come. Beast gets whole lines; with half of a body's last one it asserts what is not so.
  std::size_t used = 0;
  while (!is_done() && used + judged_ < bytes.size()) {
    const std::size_t judged = chunks_.judge(bytes.substr(used + judged_));
    judged_ += judged;
    if (!chunks_.lines_are_whole()) break;
    const std::size_t taken = feed(bytes.substr(used, judged_));
    if (judged == 0 || taken != judged_) throw bad_framing("not a well-formed body of chunks");
    used += taken;
    judged_ = 0;
  }
  return used;
}

void RequestParser::refuse(beast::error_code& ec, http::status status, std::string slug,
                           std::string detail) {
  refusal_.emplace(status, std::move(slug), std::move(detail));
  refusal_->closing();
  ec = http::error::bad_field;
}

void RequestParser::on_request_impl(http::verb method, beast::string_view method_text,
                                    beast::string_view target, int version, beast::error_code& ec) {
  ec = {};
  request_.verb = method;
  if (method == http::verb::put) {
    body_limit(is_content_path(view(target)) ? limits_.max_content_bytes
                                             : limits_.max_upload_bytes);
  }
  request_.method = std::string(view(method_text));
  request_.target = std::string(view(target));
  http_1_0_ = version == 10;
}

void RequestParser::on_response_impl(int, beast::string_view, int, beast::error_code& ec) {
  ec = http::error::bad_version;
}

void RequestParser::on_field_impl(http::field name, beast::string_view name_text,
                                  beast::string_view value, beast::error_code& ec) {
  ec = {};
  const auto bad = [&](std::string detail) {
    refuse(ec, http::status::bad_request, "bad-framing", std::move(detail));
  };
  if (++field_count_ > limits_.max_fields) {
    return refuse(ec, http::status::request_header_fields_too_large, "headers-too-large",
                  "more than " + std::to_string(limits_.max_fields) + " header fields");
  }
  if (name == http::field::host) {
    if (++host_count_ > 1) return bad("more than one Host");
    if (!is_host(view(value))) return bad("Host is not host[:port]");
    request_.host = lower_case(view(value));
  } else if (name == http::field::content_length) {
    if (has_length_) return bad("more than one Content-Length");
    if (has_coding_) return bad("Content-Length beside Transfer-Encoding");
    if (!all_digits(view(value))) return bad("Content-Length is not a number");
    has_length_ = true;
  } else if (name == http::field::transfer_encoding) {
    if (has_coding_) return bad("more than one Transfer-Encoding");
    if (has_length_) return bad("Transfer-Encoding beside Content-Length");
    if (http_1_0_) return bad("Transfer-Encoding in HTTP/1.0");
    if (!beast::iequals(value, "chunked")) return bad("Transfer-Encoding must be chunked alone");
    has_coding_ = true;
  }
  request_.fields.insert(name_text, value);
}

void RequestParser::on_header_impl(beast::error_code& ec) {
  ec = {};
  if (host_count_ == 0 && !http_1_0_)
    refuse(ec, http::status::bad_request, "bad-framing", "Host is missing");
}

void RequestParser::on_body_init_impl(const boost::optional<std::uint64_t>& length,
                                      beast::error_code& ec) {
  ec = {};
  // What is said is not believed before it comes.
  constexpr std::uint64_t kMostReserved = std::uint64_t{1} << 20;
  if (length) request_.body.reserve(static_cast<std::size_t>(std::min(*length, kMostReserved)));
}

std::size_t RequestParser::on_body_impl(beast::string_view body, beast::error_code& ec) {
  ec = {};
  request_.body.append(body.data(), body.size());
  return body.size();
}

void RequestParser::on_chunk_header_impl(std::uint64_t, beast::string_view extensions,
                                         beast::error_code& ec) {
  ec = {};
  extension_bytes_ += extensions.size();
  if (extension_bytes_ > kMaxExtensionBytes)
    refuse(ec, http::status::bad_request, "bad-framing", "too many bytes of chunk extensions");
}

std::size_t RequestParser::on_chunk_body_impl(std::uint64_t, beast::string_view body,
                                              beast::error_code& ec) {
  return on_body_impl(body, ec);
}

void RequestParser::on_finish_impl(beast::error_code& ec) { ec = {}; }

bool HeadReader::take(std::string& unread, RequestParser& parser) {
  if (!skipped_empty_line_ && unread.starts_with("\r\n")) {
    unread.erase(0, 2);
    skipped_empty_line_ = true;
  }
  if (!skipped_empty_line_ && unread == "\r") return false;
  const auto length = scanner_.scan(unread);
  if (!length) return false;
  parser.read_head(std::string_view(unread).substr(0, *length));
  unread.erase(0, *length);
  return true;
}

bool take_body(std::string& unread, RequestParser& parser) {
  if (!unread.empty() && !parser.is_done()) unread.erase(0, parser.read_body(unread));
  return parser.is_done();
}

void resolve_target(Request& request) {
  std::string_view target = request.target;
  const auto bad_target = [] { return bad_framing("the request target is malformed"); };
  const auto printable = [](unsigned char c) { return c > 0x20 && c < 0x7F && c != '#'; };
  if (!std::all_of(target.begin(), target.end(), printable)) throw bad_target();
  if (target == "*" && request.verb == http::verb::options) {
    request.path = "*";
    return;
  }
  constexpr std::string_view kScheme = "http://";
  if (lower_case(target.substr(0, kScheme.size())) == kScheme) {
    target.remove_prefix(kScheme.size());
    const std::size_t end = std::min(target.find_first_of("/?"), target.size());
    if (lower_case(target.substr(0, end)) != request.host)
      throw bad_framing("the request target and Host name different hosts");
    target.remove_prefix(end);
    if (target.empty()) target = "/";
  }
  if (target.front() != '/') throw bad_target();
  const std::size_t question = target.find('?');
  request.path = std::string(target.substr(0, question));
  if (question != std::string_view::npos) request.query = std::string(target.substr(question + 1));
}

}  // namespace fstop::server
