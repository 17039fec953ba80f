// More bytes that a server meets: paths, methods, names, bodies, JSON and headers of our own, each
// with its exact status and a canary behind it (framing_test.cpp has the framing itself). Then
// thousands of requests changed at random.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/dice.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"
#include "tests/http/wire.h"

namespace fstop::test {
namespace {

constexpr After kOn = After::goes_on;

Case path(const std::string& target, int status) {
  return {"GET " + target, get(kHost, "GET " + target + " HTTP/1.1"), status, kOn};
}

std::vector<Case> paths() {
  return {
      path("/", 200),
      path("/index.html", 200),
      path("/assets/page-1a2b3c.js", 200),
      path("/assets/%70age-1a2b3c.js", 200),
      path("/?", 200),
      path("/?a=b&a=b", 200),
      path("/livez?x", 200),
      path("/openapi.json", 200),
      path("/metrics", 200),
      path("/v1/limits", 200),
      path("/../secret", 404),
      path("/../../../../../../etc/passwd", 404),
      path("/..%2f..%2fetc%2fpasswd", 404),
      path("/%2e%2e/%2e%2e/etc/passwd", 404),
      path("/%2e%2e%2fsecret", 404),
      path("/.%2e/secret", 404),
      path("/assets/..%2f..%2fsecret", 404),
      path("/assets/./page-1a2b3c.js", 404),
      path("/..%5csecret", 404),
      path("/%c0%ae%c0%ae/secret", 404),  // an overlong dot
      path("/%e0%80%ae/secret", 404),
      path("/%252e%252e%252fsecret", 404),
      path("/....//secret", 404),
      path("/..;/secret", 404),
      path("/link", 404),
      path("/.hidden", 404),
      path("/.git/config", 404),
      path("/.env", 404),
      path("/proc/self/environ", 404),
      path("//", 404),
      path("///etc/passwd", 404),
      path("/assets", 404),
      path("/assets/", 404),
      path("/index.html/", 404),
      path("/INDEX.HTML", 404),
      path("/index.html%20", 404),
      path("/index.html%0d%0aX:y", 404),
      path("/%00", 400),
      path("/index.html%00", 400),
      path("/%", 400),
      path("/%4", 400),
      path("/%g0", 400),
      path("/%%", 400),
      path("/v1/renders/", 404),
      path("/v1/renders/..", 404),
      path("/v1/renders/%2e%2e/image", 404),
      path("/v1/renders/" + std::string(64, '0'), 404),
      path("/v1/renders/" + std::string(64, 'f') + "/image", 404),
      path("/v1/renders/" + std::string(4000, 'a'), 404),
      path("/v1/jobs/" + std::string(32, '0'), 404),
      path("/v1/jobs/" + std::string(32, '0') + "/events", 404),
      path("/v1/scenes/tiny/../tiny", 404),
      path("/v1/scenes/..%2ftiny", 404),
      path("/v1/scenes/%00", 404),
      path("/v2/renders", 404),
      path("/V1/limits", 404),
  };
}

Case line(const std::string& text, int status, After after = kOn) {
  return {text, get(kHost, text), status, after};
}

std::vector<Case> methods() {
  return {
      line("GET /v1/renders HTTP/1.1", 405),
      line("PUT /v1/renders HTTP/1.1", 405),
      line("PATCH /v1/renders HTTP/1.1", 405),
      line("DELETE /v1/limits HTTP/1.1", 405),
      line("POST /v1/limits HTTP/1.1", 405),
      line("DELETE / HTTP/1.1", 405),
      line("PUT /index.html HTTP/1.1", 404),
      line("DELETE /v1/jobs/none HTTP/1.1", 404),
      line("PROPFIND / HTTP/1.1", 405),
      line("get /livez HTTP/1.1", 405),
      line("OPTIONS /v1/jobs/none HTTP/1.1", 204),
      line("OPTIONS * HTTP/1.1", 204),
      line("OPTIONS /nothing HTTP/1.1", 404),
      line("POST /v1/optics HTTP/1.1", 415),  // no body, no type
      line("GET /livez HTTP/1.10", 400, After::closes),
      line("GET /livez HTTP/01.1", 400, After::closes),
      line("GET /livez HTTP/1.1 ", 400, After::closes),
      line("GET /livez HTTP/1,1", 400, After::closes),
      line("GET\t/livez HTTP/1.1", 400, After::closes),
      line("GET /livez\tHTTP/1.1", 400, After::closes),
      line("GET", 400, After::closes),
      line("GET /livez HTTP/", 400, After::closes),
      line("GET /livez HTTP/1.2", 505, After::closes),
      line("GET /livez HTTP/3.0", 505, After::closes),
  };
}

Case head(const std::string& field, int status, After after = kOn) {
  return {field.substr(0, 60), get(kHost + field + "\r\n"), status, after};
}

std::vector<Case> heads() {
  std::vector<Case> cases = {
      head("Accept: " + std::string(4000, ','), 200),
      head("If-None-Match: " + std::string(4000, '"'), 200),
      head("Range: bytes=0-0,1-1,2-2", 200),
      head("Cookie: " + std::string(4000, 'a'), 200),
      head("X-Forwarded-Host: evil.example", 200),
      head("X-HTTP-Method-Override: DELETE", 200),
      head("Expect: 100-continue", 200),
      head("traceparent: 00-zz-zz-00", 200),
      head("Connection: keep-alive", 200),
      head("Connection: keep-alive, close", 200, After::closes),
      head("Origin: http://evil.example", 200),
      head("X:", 200),
      head("X: \t ", 200),
      head("X: a, b", 200),
      head("Transfer-Encoding : chunked", 400, After::closes),
      head("Transfer-Encoding: chunked", 400, After::closes),  // a GET has no body here
      head("Content-Length : 5", 400, After::closes),
      head("Content-Length: 0x0", 400, After::closes),
      head("Content-Length: 1e1", 400, After::closes),
      head("Content-Length: -0", 400, After::closes),
      head("Content-Length: ,", 400, After::closes),
      head("X: a\x7f"
           "b",
           400, After::closes),
      head("X(Y): 1", 400, After::closes),
      head("\"X\": 1", 400, After::closes),
      head("X\x01: 1", 400, After::closes),
      head("Host: localhost", 400, After::closes),
  };
  for (const char* host : {"Host: localhost.", "Host: evil.example", "Host: 0.0.0.0", "Host: 127.1",
                           "Host: [::ffff:127.0.0.1]"}) {
    cases.push_back({host, get(std::string(host) + "\r\n"), 421, kOn});
  }
  for (const char* host : {"Host: 127.0.0.1.evil.example", "Host: localhost:65536",
                           "Host: localhost:99999", "Host: [::1", "Host: :80", "Host: a/b",
                           "Host: user:pw@localhost", "Host: localhost#x", "Host: localhost?x"}) {
    cases.push_back({host, get(std::string(host) + "\r\n"), 400, After::closes});
  }
  return cases;
}

Case body(const std::string& name, const std::string& text, int status) {
  return {name, post("Content-Length: " + std::to_string(text.size()) + "\r\n", text), status, kOn};
}

Case typed(const std::string& type, int status) {
  const std::string length = std::to_string(kOptics.size());
  // The body of what is refused for its head is not read, so the connection ends.
  return {"type " + type,
          "POST /v1/optics HTTP/1.1\r\n" + kHost + type + "Content-Length: " + length + "\r\n\r\n" +
              kOptics,
          status, status == 200 ? kOn : After::closes};
}

std::vector<Case> bodies() {
  const auto nested = [](const char* open, int depth) {
    std::string text;
    for (int i = 0; i < depth; ++i) text += open;
    return text;
  };
  const auto lens = [](const std::string& number) {
    return R"({"camera": {"lens": {"focal_length_mm": )" + number + R"(, "f_number": 2}}})";
  };
  return {
      body("optics", kOptics, 200),
      body("white space", " \r\n\t" + kOptics + "\n ", 200),
      body("empty", "", 400),
      body("white space alone", "  ", 400),
      body("null", "null", 422),
      body("number", "1", 422),
      body("array", "[]", 422),
      body("text", "\"a\"", 422),
      body("true", "true", 422),
      body("empty object", "{}", 422),
      body("cut", kOptics.substr(0, 20), 400),
      body("twice", kOptics + kOptics, 400),
      body("comment", "/* */" + kOptics, 400),
      body("trailing comma", R"({"camera": {"lens": {}},})", 400),
      body("single quotes", "{'camera': {}}", 400),
      body("byte order mark", "\xef\xbb\xbf" + kOptics, 200),  // RFC 8259 8.1: may be ignored
      body("UTF-16", std::string("{\0}\0", 4), 400),
      body("bad UTF-8", "{\"\xff\": 1}", 400),
      body("overlong UTF-8", "{\"\xc0\xaf\": 1}", 400),
      body("half a surrogate", R"({"\ud800": 1})", 400),
      body("control in text", "{\"a\nb\": 1}", 400),
      body("same member twice", R"({"camera": {}, "camera": {}})", 400),
      body("NaN", lens("NaN"), 400),
      body("Infinity", lens("Infinity"), 400),
      body("1e999", lens("1e999"), 400),
      body("1e-999", lens("1e-999"), 400),
      body("leading zero", lens("050"), 400),
      body("leading plus", lens("+50"), 400),
      body("hexadecimal", lens("0x32"), 400),
      body("point alone", lens("50."), 400),
      body("minus zero", lens("-0"), 422),
      body("negative", lens("-50"), 422),
      body("text for a number", lens("\"50\""), 422),
      body("true for a number", lens("true"), 422),
      body("object for a number", lens("{}"), 422),
      body("2^64", lens("18446744073709551616"), 422),
      body("100000 digits", lens(std::string(100'000, '9')), 400),
      body("long digits behind the point", lens("50." + std::string(10'000, '0')), 200),
      body("deep arrays", nested("[", 100'000), 400),
      body("deep objects", nested("{\"a\":", 100'000), 400),
      body("33 deep", "{\"a\":" + nested("[", 33) + std::string(33, ']') + "}", 400),
      body("proto", R"({"__proto__": {"camera": 1}})", 422),
      body("500000 members", "{\"a\":[" + std::string(999'990, '1') + "]}", 400),
      typed("Content-Type: application/json\r\n", 200),
      typed("Content-Type: application/json;charset=utf-8\r\n", 200),
      typed("", 415),
      typed("Content-Type: text/plain\r\n", 415),
      typed("Content-Type: application/jsonp\r\n", 415),
      typed("Content-Type: multipart/form-data; boundary=application/json\r\n", 415),
      typed("Content-Type: application/json, text/plain\r\n", 415),
      typed("Content-Type: application/json\r\nContent-Encoding: gzip\r\n", 415),
      typed("Content-Type: application/json\r\nContent-Encoding: deflate, gzip\r\n", 415),
      typed("Content-Type: application/json\r\nExpect: 200-ok\r\n", 417),
      typed("Content-Type: application/json\r\nOrigin: http://evil.example\r\n", 403),
      typed("Content-Type: application/json\r\nOrigin: null\r\n", 403),
      typed("Content-Type: application/json\r\nOrigin: http://localhost\r\n", 200),
  };
}

class Hostile : public testing::TestWithParam<Case> {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static TestServer* server_;
};
TestServer* Hostile::server_ = nullptr;

TEST_P(Hostile, GetsItsStatusAndTheNextRequestIsNotMistaken) {
  expect_answers(server_->port(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Paths, Hostile, testing::ValuesIn(paths()));
INSTANTIATE_TEST_SUITE_P(Methods, Hostile, testing::ValuesIn(methods()));
INSTANTIATE_TEST_SUITE_P(Heads, Hostile, testing::ValuesIn(heads()));
INSTANTIATE_TEST_SUITE_P(Bodies, Hostile, testing::ValuesIn(bodies()));

std::string mutated(std::string bytes, Dice& dice) {
  const std::vector<std::string> pieces = {"\r\n",
                                           "\r\n\r\n",
                                           std::string(1, '\0'),
                                           ": ",
                                           "chunked",
                                           "0\r\n\r\n",
                                           "Content-Length: 3\r\n",
                                           "%00",
                                           "../",
                                           "\"",
                                           "{",
                                           "]",
                                           "1e999",
                                           "HTTP/1.1",
                                           "\xff"};
  for (std::uint32_t i = 1 + dice.below(4); i > 0 && !bytes.empty(); --i) {
    const std::size_t at = dice.below(bytes.size());
    switch (dice.below(5)) {
      case 0:
        bytes[at] = static_cast<char>(dice.below(256));
        break;
      case 1:
        bytes.erase(at, 1 + dice.below(8));
        break;
      case 2:
        bytes.insert(at, pieces[dice.below(pieces.size())]);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, 1 + dice.below(40)));
        break;
      default:
        bytes.resize(at);
    }
  }
  return bytes;
}

// FSTOP_MUTATIONS sets how many; ./dev campaign mutations asks the whole program instead.
TEST(Mutations, NeverAreA500AndTheServerGoesOn) {
  TestServer::Options options;
  options.limits.header_deadline = std::chrono::milliseconds(20);
  options.limits.body_deadline = std::chrono::milliseconds(20);
  options.limits.idle_deadline = std::chrono::milliseconds(20);
  TestServer server(options);
  const std::vector<std::string> seeds = {
      get(kHost),
      get(kHost, "GET /v1/scenes/tiny HTTP/1.1"),
      get(kHost + "Last-Event-ID: 3\r\n", "GET /v1/jobs/0123456789abcdef/events HTTP/1.1"),
      post("Content-Length: " + std::to_string(kOptics.size()) + "\r\n", kOptics),
      chunked(chunk(kOptics.substr(0, 20), ";a=b") + chunk(kOptics.substr(20)) + "0\r\n\r\n"),
      request_text("POST", "/v1/renders",
                   {{"Prefer", "wait=1"}, {"Idempotency-Key", "k"}, {"Fstop-Deadline-Ms", "2000"}},
                   tiny_request()),
      request_text("POST", "/v1/psf", {{"Accept", "application/json"}},
                   R"({"camera": {"lens": {"f_number": 8}}, "object_distance_m": 3})"),
  };
  const char* wanted = std::getenv("FSTOP_MUTATIONS");
  const int count = wanted == nullptr ? 2000 : std::atoi(wanted);
  Dice dice(20240229);
  int answered = 0;
  for (int i = 0; i < count; ++i) {
    const std::string bytes = mutated(seeds[dice.below(seeds.size())], dice);
    Client client(server.port());
    client.send(bytes);
    const auto answer = client.read(false, std::chrono::milliseconds(5000));
    if (!answer) continue;
    ++answered;
    ASSERT_NE(answer->status, 500) << i << ": " << bytes << '\n' << server.log_text();
  }
  EXPECT_GT(answered, count / 2);
  EXPECT_EQ(ask(server.port(), "GET", "/readyz").status, 200);
}

}  // namespace
}  // namespace fstop::test
