// What goes over the wire, byte by byte: each case is sent with a second request behind it, which
// must be answered exactly where the connection goes on.
#include <chrono>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"
#include "tests/http/wire.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using namespace std::string_literals;

std::vector<Case> accepted() {
  std::string fields_100 = kHost;
  for (int i = 0; i < 99; ++i) fields_100 += "X-" + std::to_string(i) + ": 1\r\n";
  return {
      {"plain", get(kHost), 200, After::goes_on},
      {"empty line before", "\r\n" + get(kHost), 200, After::goes_on},
      {"host with port", get("Host: localhost:8080\r\n"), 200, After::goes_on},
      {"host in capitals", get("HOST: LocalHost\r\n"), 200, After::goes_on},
      {"host 127.0.0.1", get("Host: 127.0.0.1\r\n"), 200, After::goes_on},
      {"host [::1]", get("Host: [::1]:80\r\n"), 200, After::goes_on},
      {"100 fields", get(fields_100), 200, After::goes_on},
      {"no space after colon", get("Host:localhost\r\n"), 200, After::goes_on},
      {"bytes above 127 in a value", get(kHost + "X: \xc3\xa9\r\n"), 200, After::goes_on},
      {"absolute target", get(kHost, "GET http://localhost/livez HTTP/1.1"), 200, After::goes_on},
      {"query", get(kHost, "GET /livez?a=b HTTP/1.1"), 200, After::goes_on},
      {"length 0", get(kHost + "Content-Length: 0\r\n"), 200, After::goes_on},
      {"close", get(kHost + "Connection: close\r\n"), 200, After::closes},
      {"close in a list", get(kHost + "Connection: x, Close\r\n"), 200, After::closes},
      {"HTTP/1.0", get("", "GET /livez HTTP/1.0"), 200, After::closes},
      {"upgrade is ignored", get(kHost + "Connection: upgrade\r\nUpgrade: h2c\r\n"), 200,
       After::goes_on},
      {"options of all", get(kHost, "OPTIONS * HTTP/1.1"), 204, After::goes_on},
      {"options", get(kHost, "OPTIONS /v1/renders HTTP/1.1"), 204, After::goes_on},
      {"body by length",
       post("Content-Length: " + std::to_string(kOptics.size()) + "\r\n", kOptics), 200,
       After::goes_on},
      {"body in chunks",
       chunked(chunk(kOptics.substr(0, 7)) + chunk(kOptics.substr(7)) + "0\r\n\r\n"), 200,
       After::goes_on},
      {"chunk extension", chunked(chunk(kOptics, ";a=b") + "0;c\r\n\r\n"), 200, After::goes_on},
      {"chunked in capitals", post("Transfer-Encoding: CHUNKED\r\n", chunk(kOptics) + "0\r\n\r\n"),
       200, After::goes_on},
      {"unknown path", get(kHost, "GET /nothing HTTP/1.1"), 404, After::goes_on},
      {"unknown method", get(kHost, "BREW /livez HTTP/1.1"), 405, After::goes_on},
      {"trace", get(kHost, "TRACE / HTTP/1.1"), 405, After::goes_on},
  };
}

std::vector<Case> bad_heads() {
  std::string fields_101 = kHost;
  for (int i = 0; i < 100; ++i) fields_101 += "X-" + std::to_string(i) + ": 1\r\n";
  return {
      {"no host", get("")},
      {"two hosts", get(kHost + kHost)},
      {"two different hosts", get(kHost + "Host: example.com\r\n")},
      {"empty host", get("Host:\r\n")},
      {"host with user", get("Host: a@localhost\r\n")},
      {"host with path", get("Host: localhost/x\r\n")},
      {"host with blank", get("Host: local host\r\n")},
      {"host with bad port", get("Host: localhost:http\r\n")},
      {"two hosts in one field", get("Host: localhost, localhost\r\n")},
      {"target of another host", get(kHost, "GET http://example.com/livez HTTP/1.1")},
      {"foreign host", get("Host: example.com\r\n"), 421, After::goes_on},
      {"host by rebinding", get("Host: localhost.example.com\r\n"), 421, After::goes_on},
      {"bare line feeds", "GET /livez HTTP/1.1\nHost: localhost\n\n"},
      {"one bare line feed", "GET /livez HTTP/1.1\r\nHost: localhost\nX: y\r\n\r\n"},
      {"bare carriage return", get(kHost + "X: a\rb\r\n")},
      {"NUL", get(kHost + "X: a\0b\r\n"s)},
      {"folded line", get(kHost + "X: a\r\n b\r\n")},
      {"folded with tab", get(kHost + "X: a\r\n\tb\r\n")},
      {"blank before the first field", get(" " + kHost)},
      {"blank before colon", get(kHost + "X : a\r\n")},
      {"blank in a name", get(kHost + "X Y: a\r\n")},
      {"no colon", get(kHost + "nonsense\r\n")},
      {"empty name", get(kHost + ": a\r\n")},
      {"bytes above 127 in a name", get(kHost + "\xc3\xa9: a\r\n")},
      {"control byte in a value", get(kHost + "X: a\x01"
                                              "b\r\n")},
      {"no version", "GET /livez\r\n" + kHost + "\r\n"},
      {"version of another protocol", get(kHost, "GET /livez FTP/1.1")},
      {"version in small letters", get(kHost, "GET /livez http/1.1")},
      {"HTTP/2.0", get(kHost, "GET /livez HTTP/2.0"), 505},
      {"HTTP/0.9", get(kHost, "GET /livez HTTP/0.9"), 505},
      {"HTTP/2 preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505},
      {"two blanks", get(kHost, "GET  /livez HTTP/1.1")},
      {"blank in target", get(kHost, "GET /li vez HTTP/1.1")},
      {"fragment in target", get(kHost, "GET /livez#x HTTP/1.1")},
      {"bytes above 127 in target", get(kHost, "GET /\xc3\xa9 HTTP/1.1")},
      {"target without slash", get(kHost, "GET livez HTTP/1.1")},
      {"star for GET", get(kHost, "GET * HTTP/1.1")},
      {"connect", get(kHost, "CONNECT localhost:80 HTTP/1.1")},
      {"bad method", get(kHost, "G(T /livez HTTP/1.1")},
      {"empty method", get(kHost, " /livez HTTP/1.1")},
      {"TLS hello", "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 hello\r\n\r\n"s},
      {"garbage", "\x7f\x45LF\x02\x01\r\n\r\n"s},
      {"long header", get(kHost + "X: " + std::string(9000, 'a') + "\r\n"), 431},
      {"101 fields", get(fields_101), 431},
      {"long target", get(kHost, "GET /" + std::string(9000, 'a') + " HTTP/1.1"), 414},
      {"endless line", std::string(20000, 'a'), 414},
      {"body of GET", get(kHost + "Content-Length: 5\r\n") + "hello"},
      {"chunks of GET", get(kHost + "Transfer-Encoding: chunked\r\n") + "0\r\n\r\n"},
  };
}

std::vector<Case> bad_bodies() {
  const auto length = [](const std::string& value) {
    return post("Content-Length: " + value + "\r\n", "12345");
  };
  const auto coding = [](const std::string& value) {
    return post("Transfer-Encoding: " + value + "\r\n", "0\r\n\r\n");
  };
  const std::string five = "Content-Length: 5\r\n";
  const std::string in_chunks = "Transfer-Encoding: chunked\r\n";
  return {
      {"length then coding", post(five + in_chunks, "0\r\n\r\n")},
      {"coding then length", post(in_chunks + five, "0\r\n\r\n")},
      {"length 0 and coding", post("Content-Length: 0\r\n" + in_chunks, "0\r\n\r\n")},
      {"length with plus", length("+5")},
      {"negative length", length("-5")},
      {"length in hex", length("0x5")},
      {"length with decimals", length("5.0")},
      {"length with text", length("5 bytes")},
      {"empty length", length("")},
      {"list of lengths", length("5, 5")},
      {"length beyond 64 bit", length("99999999999999999999")},
      {"two lengths", post(five + five, "12345")},
      {"two different lengths", post(five + "Content-Length: 6\r\n", "123456")},
      {"coding gzip, chunked", coding("gzip, chunked")},
      {"coding chunked, chunked", coding("chunked, chunked")},
      {"coding chunked, identity", coding("chunked, identity")},
      {"two codings", post(in_chunks + in_chunks, "0\r\n\r\n")},
      {"coding identity", coding("identity")},
      {"coding xchunked", coding("xchunked")},
      {"coding in quotes", coding("\"chunked\"")},
      {"empty coding", coding("")},
      {"coding in HTTP/1.0", "POST /v1/optics HTTP/1.0\r\n" + kHost +
                                 "Content-Type: application/json\r\n" + in_chunks +
                                 "\r\n0\r\n\r\n"},
      {"chunk size no number", chunked("z\r\nhello\r\n0\r\n\r\n")},
      {"negative chunk size", chunked("-5\r\nhello\r\n0\r\n\r\n")},
      {"chunk size in 0x", chunked("0x5\r\nhello\r\n0\r\n\r\n")},
      {"empty chunk size", chunked("\r\nhello\r\n0\r\n\r\n")},
      {"chunk longer than said", chunked("3\r\nhello\r\n0\r\n\r\n")},
      {"chunk with bare line feed", chunked("5\nhello\n0\n\n")},
      {"blank before extension", chunked("5 5\r\nhello\r\n0\r\n\r\n")},
      {"trailers", chunked(chunk(kOptics) + "0\r\nX: y\r\n\r\n")},
      {"smuggled length in trailers", chunked(chunk(kOptics) + "0\r\nContent-Length: 9\r\n\r\n")},
      {"long chunk extension", chunked(chunk("x", ";a=" + std::string(9000, 'b')) + "0\r\n\r\n")},
      {"chunk line that ends in quotes", chunked("5;a=\"b\r\nhello\r\n0;c=\"\r\n\r\n")},
      {"chunk line that ends behind a backslash", chunked("5;a=\"b\\\r\nhello\r\n0\r\n\r\n")},
      {"last chunk's line that ends in quotes", chunked("0;a=\"b\r\n\r\n")},
      {"bare line feed in an extension", chunked("5;a=\"\n\"\r\nhello\r\n0\r\n\r\n")},
      {"NUL in an extension",
       chunked("5;a=\"" + std::string(1, '\0') + "\"\r\nhello\r\n0\r\n\r\n")},
      {"chunk size of 17 digits", chunked("00000000000000005\r\nhello\r\n0\r\n\r\n")},
      {"endless chunk line", chunked("5;" + std::string(40000, 'a'))},
      {"body over the limit", length("1048577"), 413},
      {"body far over the limit", length("18446744073709551615"), 413},
      {"body over the limit, expected",
       kPostHead + "Expect: 100-continue\r\nContent-Length: 1048577\r\n\r\n", 413},
      {"chunks over the limit", chunked("100001\r\nx"), 413},
      {"chunk size at 64 bit", chunked("ffffffffffffffff\r\nx"), 413},
      {"unknown expectation", kPostHead + "Expect: miracle\r\nContent-Length: 5\r\n\r\n", 417},
  };
}

class Framing : public testing::TestWithParam<Case> {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static TestServer* server_;
};
TestServer* Framing::server_ = nullptr;

TEST_P(Framing, IsAnsweredAndTheNextRequestIsNotMistaken) {
  expect_answers(server_->port(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Accepted, Framing, testing::ValuesIn(accepted()));
INSTANTIATE_TEST_SUITE_P(BadHeads, Framing, testing::ValuesIn(bad_heads()));
INSTANTIATE_TEST_SUITE_P(BadBodies, Framing, testing::ValuesIn(bad_bodies()));

// A parser must not depend on how the network cuts the bytes.
TEST(FramingInPieces, EveryByteAloneGivesTheSameAnswers) {
  TestServer server;
  const std::vector<std::pair<std::string, int>> requests = {
      {get(kHost), 200},
      {post("Content-Length: " + std::to_string(kOptics.size()) + "\r\n", kOptics), 200},
      {chunked(chunk(kOptics, ";x=\"\\\";\"") + "0\r\n\r\n"), 200},
      {chunked("5;a=\"b\r"), 400},  // by its last byte
  };
  Client client(server.port());
  for (const auto& [bytes, status] : requests) {
    for (const char byte : bytes) ASSERT_TRUE(client.send(std::string_view(&byte, 1)));
    const auto answer = client.read();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, status) << answer->body;
  }
}

TEST(FramingInPieces, ExpectationIsMetBeforeTheBodyIsSent) {
  TestServer server;
  Client client(server.port());
  client.send(kPostHead + "Expect: 100-continue\r\nContent-Length: " +
              std::to_string(kOptics.size()) + "\r\n\r\n");
  const auto go_on = client.read(true);
  ASSERT_TRUE(go_on);
  EXPECT_EQ(go_on->status, 100);
  client.send(kOptics);
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200) << answer->body;
}

TEST(FramingInPieces, ManyPipelinedRequestsAreAnsweredInOrder) {
  TestServer server;
  Client client(server.port());
  std::string bytes;
  for (int i = 0; i < 50; ++i)
    bytes += get(kHost, i % 2 == 0 ? "GET /livez HTTP/1.1" : "GET /no HTTP/1.1");
  client.send(bytes);
  for (int i = 0; i < 50; ++i) {
    const auto answer = client.read();
    ASSERT_TRUE(answer) << i;
    EXPECT_EQ(answer->status, i % 2 == 0 ? 200 : 404) << i;
  }
}

// Deadlines are absolute: bytes that drip in do not move them.
TEST(Deadlines, DrippingHeaderAndBodyEndWith408AndIdleConnectionsClose) {
  TestServer::Options options;
  options.limits.header_deadline = 300ms;
  options.limits.body_deadline = 300ms;
  options.limits.idle_deadline = 300ms;
  TestServer server(options);
  const auto drips = [&](const std::string& start) {
    Client client(server.port());
    client.send(start);
    for (int i = 0; i < 100; ++i) {
      if (const auto answer = client.read(false, 50ms)) return answer->status;
      client.send("a");
    }
    return 0;
  };
  EXPECT_EQ(drips("GET /livez HTTP/1.1\r\nX: "), 408);
  EXPECT_EQ(drips(kPostHead + "Content-Length: 1000\r\n\r\n"), 408);
  Client idle(server.port());
  EXPECT_TRUE(idle.is_closed_by_server(5s));
  Client kept(server.port());
  EXPECT_EQ(kept.ask("GET", "/livez").status, 200);
  EXPECT_TRUE(kept.is_closed_by_server(5s));
  EXPECT_EQ(ask(server.port(), "GET", "/livez").status, 200);
}

// Far more than the socket's buffers hold is asked for and not read: of them some replies fit in.
TEST(Deadlines, ReplyThatIsNotReadEndsTheConnection) {
  TestServer::Options options;
  options.limits.write_deadline = 200ms;
  TestServer server(options);
  constexpr int kRequests = 1000;
  std::string requests;
  for (int i = 0; i < kRequests; ++i) requests += get(kHost, "GET /metrics HTTP/1.1");
  Client client(server.port());
  client.send(requests);
  std::this_thread::sleep_for(1s);
  int answered = 0;
  while (client.read(false, 10s)) ++answered;
  EXPECT_GT(answered, 0);
  EXPECT_LT(answered, kRequests);
  EXPECT_EQ(ask(server.port(), "GET", "/livez").status, 200);
}

TEST(Connections, BeyondTheBoundAreToldToComeBack) {
  TestServer::Options options;
  options.limits.connections = 4;
  TestServer server(options);
  std::vector<Client> held;
  for (int i = 0; i < 4; ++i) {
    held.emplace_back(server.port());
    EXPECT_EQ(held.back().ask("GET", "/livez").status, 200);
  }
  Client late(server.port());
  const auto answer = late.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 503);
  EXPECT_EQ(answer->header("retry-after"), "1");
  EXPECT_TRUE(late.is_closed_by_server());
  held.pop_back();
  EXPECT_TRUE(eventually([&] { return Client(server.port()).ask("GET", "/livez").status == 200; }));
}

}  // namespace
}  // namespace fstop::test
