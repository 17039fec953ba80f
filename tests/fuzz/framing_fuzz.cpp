// A request as its bytes arrive: framing, head, and what is read of its fields. However the bytes
// are cut into pieces, the server must understand the same.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "api/limits.h"
#include "server/access.h"
#include "server/negotiation.h"
#include "server/preferences.h"
#include "server/request_parser.h"
#include "server/routes.h"
#include "server/trace.h"
#include "tests/fuzz/fuzz_target.h"

namespace fstop::test {
namespace {

using server::Refusal;
using server::Request;

// What one request was taken for.
struct Understood {
  unsigned status = 0;  // of its refusal; 0: none, 1: more bytes are wanted
  Request request = {};
  std::string fields = {};
  std::string left = {};
};

server::ParserLimits limits() {
  const api::Limits limits;
  return {.max_head_bytes = limits.header_bytes,
          .max_fields = static_cast<std::size_t>(limits.header_fields),
          .max_body_bytes = std::uint64_t{1} << 16,
          .max_upload_bytes = std::uint64_t{1} << 16,
          .max_content_bytes = std::uint64_t{1} << 16};
}

Understood understood(std::string_view wire, std::size_t piece) {
  Understood result{.status = 1};
  server::RequestParser parser(result.request, limits());
  server::HeadReader head(limits().max_head_bytes);
  bool has_head = false;
  bool is_done = false;
  try {
    while (!is_done && !wire.empty()) {
      result.left += wire.substr(0, piece);
      wire.remove_prefix(std::min(piece, wire.size()));
      if (!has_head) has_head = head.take(result.left, parser);
      if (has_head) is_done = parser.is_done() || server::take_body(result.left, parser);
    }
    if (is_done) {
      server::resolve_target(result.request);
      result.status = 0;
    }
  } catch (const Refusal& refusal) {
    result.status = static_cast<unsigned>(refusal.status());
    require(refusal.close(), "a refusal of framing ends the connection");
  }
  result.left += wire;
  for (const auto& field : result.request.fields) {
    result.fields.append(field.name_string().data(), field.name_string().size()).append(": ");
    result.fields.append(field.value().data(), field.value().size()).append("\n");
  }
  return result;
}

template <typename Read>
void may_refuse(const Read& read) {
  try {
    read();
  } catch (const Refusal& refusal) {
    const auto status = static_cast<unsigned>(refusal.status());
    require(status >= 400 && status < 500, "fields are refused by 4xx");
  }
}

void read_fields(Request& request) {
  static const server::AccessRules access({.address = "127.0.0.1",
                                           .token = "0123456789abcdef",
                                           .url_key = "fedcba9876543210",
                                           .origins = {"https://a.example"}});
  static const api::Limits limits;
  constexpr std::array<std::string_view, 3> kTypes = {"application/json", "image/svg+xml",
                                                      "text/event-stream"};
  constexpr std::array<std::string_view, 2> kParameters = {"format", "number"};
  const std::string_view accept = request.header("Accept");
  may_refuse([&] { access.check(request); });
  server::Reply reply;
  access.open_to_origin(request, reply);
  may_refuse([&] { server::check_content(request); });
  may_refuse([&] {
    const auto preferences = server::preferences_of(request, limits);
    require(preferences.wait <= limits.longest_wait, "nobody waits longer than may be asked for");
    require(preferences.idempotency_key.size() <= 255, "keys are short");
  });
  may_refuse([&] { server::negotiated(accept, ImageFormat::png, true); });
  may_refuse([&] { server::negotiated_numbers(accept, ImageFormat::png); });
  may_refuse([&] { require(server::negotiated_type(accept, kTypes) < 3, "one of the types"); });
  may_refuse([&] { server::query_parameters(request, kParameters); });
  const auto trace = server::trace_of(request.header("traceparent"));
  require(trace.trace_id.size() == 32 && trace.span_id.size() == 16, "a trace has its digits");
  server::remove_signature(request);
}

}  // namespace
}  // namespace fstop::test

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fstop::test;
  Input input(data, size);
  const std::size_t piece = 1 + input.choice();
  Understood whole = understood(input.text(), input.text().size() + 1);
  const Understood pieces = understood(input.text(), piece);
  require(whole.status == pieces.status, "pieces of the bytes get the status of the whole");
  if (whole.status != 0) return 0;
  require(whole.request.method == pieces.request.method, "the same method");
  require(whole.request.target == pieces.request.target, "the same target");
  require(whole.request.host == pieces.request.host, "the same host");
  require(whole.request.body == pieces.request.body, "the same body");
  require(whole.request.keep_alive == pieces.request.keep_alive, "the same end");
  require(whole.fields == pieces.fields, "the same fields");
  require(whole.left == pieces.left, "the next request begins at the same byte");
  read_fields(whole.request);
  return 0;
}
