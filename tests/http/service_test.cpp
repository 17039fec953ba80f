// What operations and pages of other origins see: metrics, traces, CORS, names, signed URLs.
#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/access.h"
#include "server/config_file.h"
#include "server/trace.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

double metric(const std::string& text, const std::string& series) {
  const std::size_t at = text.find("\n" + series + " ");
  if (at == std::string::npos) return -1.0;
  return std::stod(text.substr(at + series.size() + 2, 32));
}

TEST(MetricsPage, CountsRequestsRendersAndErrors) {
  TestServer server;
  ask(server.port(), "POST", "/v1/renders", {}, tiny_request(1));
  ask(server.port(), "POST", "/v1/renders", {}, tiny_request(1));
  ask(server.port(), "POST", "/v1/renders", {}, "{");
  ask(server.port(), "GET", "/v1/nothing");
  Client(server.port()).send("BREW\"} /x HTTP/1.1\r\n\r\n");
  const Answer page = ask(server.port(), "GET", "/metrics");
  ASSERT_EQ(page.status, 200);
  EXPECT_EQ(page.header("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  const std::string& text = page.body;
  EXPECT_EQ(metric(text, R"(fstop_requests_total{method="POST",route="/v1/renders",status="200"})"),
            2.0);
  EXPECT_EQ(metric(text, R"(fstop_errors_total{type="json-invalid"})"), 1.0);
  EXPECT_EQ(metric(text, R"(fstop_errors_total{type="not-found"})"), 1.0);
  EXPECT_EQ(metric(text, R"(fstop_renders_total{method="lens-sampling"})"), 1.0);
  EXPECT_GT(metric(text, "fstop_rays_total"), 48.0 * 32.0 * 16.0);
  EXPECT_EQ(metric(text, "fstop_cost_ratio_count"), 1.0);
  EXPECT_GT(metric(text, "fstop_cost_predicted_seconds_total"), 0.0);
  EXPECT_GT(metric(text, "fstop_cost_actual_seconds_total"), 0.0);
  EXPECT_EQ(metric(text, "fstop_cache_hits_total"), 1.0);
  EXPECT_EQ(metric(text, "fstop_cache_misses_total"), 1.0);
  EXPECT_EQ(metric(text, "fstop_queue_age_seconds"), 0.0);
  EXPECT_GT(metric(text, "process_resident_memory_bytes"), 1e6);
  EXPECT_GE(metric(text, "fstop_heap_in_use_bytes"), 0.0);  // sanitizers have heaps of their own
  EXPECT_GE(metric(text, "fstop_request_seconds_count"), 4.0);
}

TEST(Docs, AreServedFromHereAlone) {
  TestServer server;
  const Answer page = ask(server.port(), "GET", "/docs");
  EXPECT_EQ(page.status, 200);
  EXPECT_NE(page.header("content-security-policy").find("default-src 'none'"), std::string::npos);
  for (const char* path : {"/docs", "/docs/docs.js", "/docs/docs.css"}) {
    const Answer part = ask(server.port(), "GET", path);
    EXPECT_EQ(part.status, 200) << path;
    EXPECT_EQ(part.body.find("http://"), std::string::npos) << path;
    EXPECT_EQ(part.body.find("https://"), std::string::npos) << path;
  }
  EXPECT_EQ(ask(server.port(), "GET", "/docs", {{"If-None-Match", page.header("etag")}}).status,
            304);
}

TEST(Probes, HaveAPortOfTheirOwn) {
  TestServer server;
  ASSERT_NE(server.probe_port(), 0);
  for (const char* path : {"/livez", "/readyz", "/metrics"})
    EXPECT_EQ(ask(server.probe_port(), "GET", path).status, 200) << path;
  EXPECT_EQ(ask(server.probe_port(), "GET", "/v1/scenes").status, 404);
  EXPECT_EQ(ask(server.probe_port(), "GET", "/").status, 404);
  EXPECT_EQ(ask(server.probe_port(), "GET", "/livez", {{"Host", "a.example"}}).status, 421);
}

TEST(Traces, ContinueThoseThatComeInAndBeginOthers) {
  const std::string id = "0af7651916cd43dd8448eb211c80319c";
  const std::string parent = "b7ad6b7169203331";
  const std::string good = "00-" + id + "-" + parent + "-01";
  const server::TraceContext trace = server::trace_of(good);
  EXPECT_EQ(trace.trace_id, id);
  EXPECT_EQ(trace.parent_id, parent);
  EXPECT_NE(trace.span_id, parent);
  EXPECT_EQ(trace.traceparent(), "00-" + id + "-" + trace.span_id + "-01");
  EXPECT_EQ(server::trace_of("cc-" + id + "-" + parent + "-01-what-comes-later").trace_id, id);
  const std::string zeros32(32, '0');
  const std::string zeros16(16, '0');
  for (const std::string& bad : std::vector<std::string>{
           "", "00", good + "-more", "ff-" + id + "-" + parent + "-01",
           "00-" + zeros32 + "-" + parent + "-01", "00-" + id + "-" + zeros16 + "-01",
           "00-0AF7651916CD43DD8448EB211C80319C-" + parent + "-01", "00-" + id + parent + "-01",
           "0x-" + id + "-" + parent + "-01", "00-" + id + "-" + parent + "-0g"}) {
    const server::TraceContext fresh = server::trace_of(bad);
    EXPECT_NE(fresh.trace_id, id) << bad;
    EXPECT_EQ(fresh.trace_id.size(), 32U);
    EXPECT_TRUE(fresh.parent_id.empty()) << bad;
  }
  TestServer server;
  const Answer answer = ask(server.port(), "GET", "/livez", {{"traceparent", good}});
  EXPECT_EQ(answer.header("traceparent").substr(0, 35), good.substr(0, 35));
  EXPECT_TRUE(eventually(
      [&] { return server.log_text().find("\"trace_id\":\"" + id + "\"") != std::string::npos; }));
  EXPECT_NE(server.log_text().find("\"parent_id\":\"" + parent + "\""), std::string::npos);
}

TEST(Cors, OnlyListedOriginsMayUseTheServer) {
  TestServer::Options options;
  options.token = "0123456789abcdef";
  options.origins = {"https://app.example"};
  TestServer server(options);
  const Headers token = {{"Authorization", "Bearer 0123456789abcdef"}};
  const auto with = [](Headers headers, const std::string& origin) {
    headers.emplace_back("Origin", origin);
    return headers;
  };
  const Answer preflight =
      ask(server.port(), "OPTIONS", "/v1/renders",
          with({{"Access-Control-Request-Method", "POST"}}, "https://app.example"));
  EXPECT_EQ(preflight.status, 204);
  EXPECT_EQ(preflight.header("access-control-allow-origin"), "https://app.example");
  EXPECT_NE(preflight.header("access-control-allow-methods").find("DELETE"), std::string::npos);
  EXPECT_NE(preflight.header("access-control-allow-headers").find("Authorization"),
            std::string::npos);
  const Answer posted =
      ask(server.port(), "POST", "/v1/renders", with(token, "https://app.example"), tiny_request());
  EXPECT_EQ(posted.status, 200);
  EXPECT_EQ(posted.header("access-control-allow-origin"), "https://app.example");
  EXPECT_NE(posted.header("access-control-expose-headers").find("Fstop-Render-Id"),
            std::string::npos);
  for (const char* origin : {"https://app.example.evil", "http://app.example", "null", "*",
                             "https://app.example:8443", "HTTPS://APP.EXAMPLE"}) {
    const Answer refused =
        ask(server.port(), "POST", "/v1/renders", with(token, origin), tiny_request());
    EXPECT_EQ(refused.status, 403) << origin;
    EXPECT_EQ(refused.header("access-control-allow-origin"), "") << origin;
    EXPECT_EQ(ask(server.port(), "OPTIONS", "/v1/renders",
                  with({{"Access-Control-Request-Method", "POST"}}, origin))
                  .status,
              401)
        << origin;
  }
  EXPECT_EQ(
      ask(server.port(), "POST", "/v1/renders", with({}, "https://app.example"), tiny_request())
          .status,
      401)
      << "an allowed origin still needs the token";
}

TEST(Hosts, FurtherNamesAreThoseListed) {
  TestServer::Options options;
  options.hosts = {"fstop.example"};
  TestServer server(options);
  EXPECT_EQ(ask(server.port(), "GET", "/livez", {{"Host", "fstop.example"}}).status, 200);
  EXPECT_EQ(ask(server.port(), "GET", "/livez", {{"Host", "FSTOP.example:8080"}}).status, 200);
  EXPECT_EQ(ask(server.port(), "GET", "/livez", {{"Host", "other.example"}}).status, 421);
  EXPECT_EQ(ask(server.port(), "GET", "/livez", {{"Host", "a.fstop.example"}}).status, 421);
}

TEST(SignedUrls, OpenOneTargetForReadingUntilTheyExpire) {
  TestServer::Options options;
  options.token = "0123456789abcdef";
  options.url_key = "a key of the house";
  TestServer server(options);
  const Headers token = {{"Authorization", "Bearer 0123456789abcdef"}};
  const std::string id =
      ask(server.port(), "POST", "/v1/renders", token, tiny_request()).header("fstop-render-id");
  const std::int64_t now = std::chrono::duration_cast<std::chrono::seconds>(
                               std::chrono::system_clock::now().time_since_epoch())
                               .count();
  const std::string image = "/v1/renders/" + id + "/image";
  const auto signed_for = [&](const std::string& target, std::int64_t seconds,
                              const std::string& key = "a key of the house") {
    return server::signed_target(target, now + seconds, key);
  };
  const auto status = [&](const std::string& target) {
    return ask(server.port(), "GET", target).status;
  };
  EXPECT_EQ(status(image), 401);
  EXPECT_EQ(status(signed_for(image, 60)), 200);
  EXPECT_EQ(status(signed_for(image + "?format=exr", 60)), 200);
  EXPECT_EQ(ask(server.port(), "HEAD", signed_for(image, 60)).status, 200);
  EXPECT_EQ(status(signed_for(image, -1)), 401) << "expired";
  EXPECT_EQ(status(signed_for(image, 60, "another key")), 401);
  std::string moved = signed_for(image, 60);
  moved.replace(moved.find("/image"), 6, "/other");
  EXPECT_EQ(status(moved), 401) << "another path";
  std::string longer = signed_for(image, 60);
  longer.replace(longer.find("expires=") + 8, 1, "9");
  EXPECT_EQ(status(longer), 401) << "another time";
  std::string other = signed_for(image + "?format=exr", 60);
  other.replace(other.find("exr"), 3, "png");
  EXPECT_EQ(status(other), 401) << "another query";
  EXPECT_EQ(status(signed_for(image, 60) + "0"), 401);
  EXPECT_EQ(status(image + "?expires=&signature="), 401);
  EXPECT_EQ(ask(server.port(), "POST", signed_for("/v1/renders", 60), {}, tiny_request()).status,
            401)
      << "for reading alone";
  EXPECT_EQ(server.log_text().find("signature="), std::string::npos);
}

TEST(ConfigFile, StandsBehindTheEnvironmentAndIsRefusedWhereItIsWrong) {
  EXPECT_EQ(server::variable_of("--data-dir"), "FSTOP_DATA_DIR");
  TemporaryFolder folder;
  const std::string file = (folder.path() / "config").string();
  const std::vector<std::string> options = {"test-first", "test-second"};
  const auto apply = [&](const std::string& text) {
    folder.write("config", text);
    server::apply_config_file(file, options);
  };
  ::setenv("FSTOP_TEST_FIRST", "from the environment", 1);
  apply("# a comment\n\n test-first = from the file \r\ntest-second=b = c\n");
  EXPECT_STREQ(::getenv("FSTOP_TEST_FIRST"), "from the environment");
  EXPECT_STREQ(::getenv("FSTOP_TEST_SECOND"), "b = c");
  for (const char* text : {"test-third = 1\n", "test-first\n", "test-first = 1\ntest-first = 2\n",
                           "--test-first = 1\n", "= 1\n"}) {
    EXPECT_THROW(apply(text), Error) << text;
  }
  EXPECT_THROW(server::apply_config_file(file + "-none", options), Error);
}

}  // namespace
}  // namespace fstop::test
