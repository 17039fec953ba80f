#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <boost/beast/core/error.hpp>
#include <boost/beast/http/basic_parser.hpp>
#include <boost/optional/optional.hpp>

#include "server/chunk_scanner.h"
#include "server/http_message.h"

namespace fstop::server {

/// Finds the end of a request's head while its bytes arrive, and refuses at once what two HTTP
/// implementations may read differently: bare CR or LF, folded lines, NUL.
class HeadScanner {
 public:
  explicit HeadScanner(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// `bytes`: all that has come so far. The length of the head with its empty line, once it is
  /// there. Throws: Refusal 400, 414 or 431, all closing.
  std::optional<std::size_t> scan(std::string_view bytes);

 private:
  std::size_t max_bytes_;
  std::size_t position_ = 0;    // bytes before it are judged
  std::size_t line_start_ = 0;  // where the line of position_ begins
};

struct ParserLimits {
  std::size_t max_head_bytes = 0;
  std::size_t max_fields = 0;
  std::uint64_t max_body_bytes = 0;
  std::uint64_t max_upload_bytes = 0;   // of a PUT
  std::uint64_t max_content_bytes = 0;  // of a PUT of any bytes, /v1/files/...
};

/// Beast's parser, made stricter where RFC 9112 lets a server choose or Beast 1.81 is lenient:
/// one Host, one Content-Length of digits, Transfer-Encoding exactly `chunked` and never beside
/// Content-Length, no trailers, bounded chunk extensions within their line.
class RequestParser final : public http::basic_parser<true> {
 public:
  RequestParser(Request& request, const ParserLimits& limits);

  /// `head`: what HeadScanner found. Throws: Refusal, closing.
  void read_head(std::string_view head);
  /// Takes what it can of `bytes`; returns how many. Throws: Refusal, closing.
  std::size_t read_body(std::string_view bytes);

 private:
  void on_request_impl(http::verb method, boost::beast::string_view method_text,
                       boost::beast::string_view target, int version,
                       boost::beast::error_code& ec) override;
  void on_response_impl(int code, boost::beast::string_view reason, int version,
                        boost::beast::error_code& ec) override;
  void on_field_impl(http::field name, boost::beast::string_view name_text,
                     boost::beast::string_view value, boost::beast::error_code& ec) override;
  void on_header_impl(boost::beast::error_code& ec) override;
  void on_body_init_impl(const boost::optional<std::uint64_t>& length,
                         boost::beast::error_code& ec) override;
  std::size_t on_body_impl(boost::beast::string_view body, boost::beast::error_code& ec) override;
  void on_chunk_header_impl(std::uint64_t size, boost::beast::string_view extensions,
                            boost::beast::error_code& ec) override;
  std::size_t on_chunk_body_impl(std::uint64_t remain, boost::beast::string_view body,
                                 boost::beast::error_code& ec) override;
  void on_finish_impl(boost::beast::error_code& ec) override;

  std::size_t feed(std::string_view bytes);
  void refuse(boost::beast::error_code& ec, http::status status, std::string slug,
              std::string detail);

  Request& request_;
  ParserLimits limits_;
  std::optional<Refusal> refusal_ = {};
  std::size_t field_count_ = 0;
  std::size_t host_count_ = 0;
  ChunkScanner chunks_ = {};
  std::size_t judged_ = 0;  // bytes the scanner has judged and Beast has not taken
  std::size_t extension_bytes_ = 0;
  bool http_1_0_ = false;
  bool has_length_ = false;
  bool has_coding_ = false;
};

/// Takes one request's head off what has come of a connection; an empty line before it is passed
/// over (RFC 9112 2.2).
class HeadReader {
 public:
  explicit HeadReader(std::size_t max_bytes) : scanner_(max_bytes) {}

  /// Whether the head was there; then `parser` has it and `unread` begins behind it.
  /// Throws: Refusal, closing.
  bool take(std::string& unread, RequestParser& parser);

 private:
  HeadScanner scanner_;
  bool skipped_empty_line_ = false;
};

/// Takes off `unread` what it has of the body. Whether the body has ended. Throws: Refusal,
/// closing.
bool take_body(std::string& unread, RequestParser& parser);

/// Splits `request.target` into path and query and fills `request.host`; accepts origin form,
/// `http://` absolute form that names the same host, and `*` for OPTIONS.
/// Throws: Refusal 400, closing.
void resolve_target(Request& request);

}  // namespace fstop::server
