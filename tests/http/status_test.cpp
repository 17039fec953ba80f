// What each call answers, good and bad: statuses, headers, pointers.
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

class Calls : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static Answer ask(std::string_view method, std::string_view target, const Headers& headers = {},
                    std::string_view body = {}) {
    return test::ask(server_->port(), method, target, headers, body);
  }
  static Answer post(const std::string& body, const Headers& headers = {}) {
    return ask("POST", "/v1/renders", headers, body);
  }
  static TestServer* server_;
};
TestServer* Calls::server_ = nullptr;

bool is_problem(const Answer& answer) {
  return answer.header("content-type") == "application/problem+json" &&
         answer.body.find("\"type\":\"/problems/") != std::string::npos &&
         answer.body.find("\"status\":" + std::to_string(answer.status)) != std::string::npos;
}

TEST_F(Calls, ProbesScenesAndContractAnswer) {
  for (const char* path : {"/livez", "/readyz", "/openapi.json", "/v1/scenes", "/v1/scenes/tiny"}) {
    const Answer answer = ask("GET", path);
    EXPECT_EQ(answer.status, 200) << path;
    EXPECT_EQ(answer.header("content-type"), "application/json") << path;
    EXPECT_EQ(answer.header("x-content-type-options"), "nosniff") << path;
    EXPECT_FALSE(answer.header("date").empty()) << path;
    const Answer head = ask("HEAD", path);
    EXPECT_EQ(head.status, 200) << path;
    EXPECT_EQ(head.header("content-length"), answer.header("content-length")) << path;
    EXPECT_TRUE(head.body.empty()) << path;
  }
  EXPECT_NE(ask("GET", "/v1/scenes").body.find("A ball before a wall."), std::string::npos);
  EXPECT_NE(ask("GET", "/v1/scenes/tiny").body.find("fstop-scene/1"), std::string::npos);
  EXPECT_NE(ask("GET", "/openapi.json").body.find("/v1/renders"), std::string::npos);
}

TEST_F(Calls, OpticsAnswersTheNumbersOfACamera) {
  const Answer answer = ask("POST", "/v1/optics", {}, R"({
    "camera": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}},
    "object_distances_m": [1, "infinity"]})");
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/json");
  for (const char* member : {"image_distance_mm", "hyperfocal_m", "coc_px", "intrinsics_px"})
    EXPECT_NE(answer.body.find(member), std::string::npos) << member;
  const Answer faulty =
      ask("POST", "/v1/optics", {}, R"({"camera": {"lens": {"focal_length_mm": "long"}}})");
  EXPECT_EQ(faulty.status, 422);
  EXPECT_NE(faulty.body.find("#/camera/lens/focal_length_mm"), std::string::npos) << faulty.body;
}

TEST_F(Calls, UnknownPathsAndMethodsAreProblems) {
  struct Expected {
    const char* method;
    const char* path;
    int status;
    const char* allow;
  };
  const std::vector<Expected> table = {
      {"GET", "/v1", 404, ""},
      {"GET", "/v1/", 404, ""},
      {"GET", "/v1/renders/", 404, ""},
      {"GET", "/v1/jobs/1", 404, ""},
      {"GET", "/v1/renders/0000", 404, ""},
      {"GET", "/v1/renders/0000/image", 404, ""},
      {"GET", "/v1/renders/0000/outputs/depth", 404, ""},
      {"GET", "/v1/renders/0000/outputs/sound", 404, ""},
      {"GET", "/v1/renders/0000/image/more", 404, ""},
      {"GET", "/v1/scenes/none", 404, ""},
      {"GET", "/v1/scenes/..%2F..%2Fsecret", 404, ""},
      {"GET", "/v1/scenes/%2e%2e", 404, ""},
      {"GET", "/livez/", 404, ""},
      {"GET", "//livez", 404, ""},
      {"GET", "/LIVEZ", 404, ""},
      {"GET", "/nothing.html", 404, ""},
      {"POST", "/nothing", 404, ""},
      {"PUT", "/nothing", 404, ""},
      {"GET", "/v1/renders", 405, "POST, OPTIONS"},
      {"GET", "/v1/optics", 405, "POST, OPTIONS"},
      {"GET", "/v1/psf", 405, "POST, OPTIONS"},
      {"DELETE", "/v1/renders", 405, "POST, OPTIONS"},
      {"POST", "/livez", 405, "GET, HEAD, OPTIONS"},
      {"POST", "/v1/scenes", 405, "GET, HEAD, OPTIONS"},
      {"DELETE", "/v1/scenes/tiny", 405, "GET, HEAD, PUT, OPTIONS"},
      {"POST", "/", 405, "GET, HEAD, OPTIONS"},
      {"OPTIONS", "/v1/renders", 204, "POST, OPTIONS"},
      {"OPTIONS", "/v1/scenes/tiny", 204, "GET, HEAD, PUT, OPTIONS"},
      {"OPTIONS", "/nothing", 404, ""},
  };
  for (const Expected& expected : table) {
    const Answer answer = ask(expected.method, expected.path);
    EXPECT_EQ(answer.status, expected.status) << expected.method << ' ' << expected.path;
    EXPECT_EQ(answer.header("allow"), expected.allow) << expected.method << ' ' << expected.path;
    EXPECT_EQ(is_problem(answer), answer.status >= 400) << answer.body;
  }
}

TEST_F(Calls, BadRequestsNameThePointer) {
  const std::string lens =
      R"("lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2})";
  const auto with_camera = [](const std::string& camera) {
    return R"({"scene": "tiny", "camera": {)" + camera + "}}";
  };
  const auto with = [&](const std::string& members) {
    return R"({"scene": "tiny", "camera": {)" + lens + "}, " + members + "}";
  };
  struct Expected {
    std::string body;
    int status;
    const char* text;  // that the problem contains
  };
  const std::vector<Expected> table = {
      {with(R"("flash": true)"), 422, "#/flash"},
      {with(R"("seed": "1")"), 422, "#/seed"},
      {with(R"("seed": 4294967296)"), 422, "#/seed"},
      {with(R"("seed": 1.5)"), 422, "#/seed"},
      {with(R"("image": {"width": "wide"})"), 422, "#/image/width"},
      {with(R"("image": {"width": 1000000, "height": 1000000})"), 422, "#/image"},
      {with(R"("image": {"width": 0})"), 422, "#/image/width"},
      {with(R"("image": {"width": 1e999})"), 400, ""},
      {with(R"("quality": {"max_error": NaN})"), 400, ""},
      {with(R"("quality": {"max_error": "NaN"})"), 422, "#/quality/max_error"},
      {with(R"("quality": {"method": "magic"})"), 422, "#/quality/method"},
      {with(R"("outputs": ["color", "sound"])"), 422, "#/outputs/1"},
      {with_camera(R"("lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 0.05})"),
       422, "#/camera/lens/focus_distance_m"},
      {with_camera(R"("lens": {"focal_length_mm": "50", "f_number": 2, "focus_distance_m": 2})"),
       422, "#/camera/lens/focal_length_mm"},
      {with_camera(R"("lens": {"focal_length_mm": -50, "f_number": 2, "focus_distance_m": 2})"),
       422, "#/camera/lens/focal_length_mm"},
      {R"({"camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "../../etc/passwd", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "..", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "scene.json", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "none", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "broken-mesh", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": "no-texture", "camera": {)" + lens + "}}", 422, "#/scene"},
      {R"({"scene": {"format": "fstop-scene/1", "textures": {"a": {"file": "tiny/gone.png"}}},
           "camera": {)" +
           lens + "}}",
       422, "#/scene/textures/a/file"},
      {R"({"scene": {"format": "fstop-scene/1", "textures": {"a": {"file": "../../secret"}}},
           "camera": {)" +
           lens + "}}",
       422, "#/scene/textures/a/file"},
      {"", 400, ""},
      {"{", 400, ""},
      {"[]", 422, ""},
      {"null", 422, ""},
      {"{\"scene\": \"tiny\", \"scene\": \"tiny\"}", 400, ""},
      {std::string(100000, '['), 400, ""},
      {"\xff\xfe{}", 400, ""},
      {tiny_request() + "x", 400, ""},
      {tiny_request() + std::string(1, '\0'), 400, ""},
  };
  for (const Expected& expected : table) {
    const Answer answer = post(expected.body, {{"Content-Type", "application/json"}});
    const std::string shown = expected.body.substr(0, 120);
    EXPECT_EQ(answer.status, expected.status) << shown << '\n' << answer.body;
    EXPECT_TRUE(is_problem(answer)) << shown << '\n' << answer.body;
    EXPECT_NE(answer.body.find(expected.text), std::string::npos) << shown << '\n' << answer.body;
  }
  EXPECT_EQ(ask("GET", "/readyz").status, 200);
  EXPECT_EQ(post(tiny_request()).status, 200);
}

TEST_F(Calls, ContentMustBePlainJson) {
  const std::string body = tiny_request();
  const auto status = [&](const Headers& headers) { return post(body, headers).status; };
  EXPECT_EQ(status({{"Content-Type", "application/json; charset=utf-8"}}), 200);
  EXPECT_EQ(status({{"Content-Type", "Application/JSON"}}), 200);
  EXPECT_EQ(status({{"Content-Type", "text/plain"}}), 415);
  EXPECT_EQ(status({{"Content-Type", "application/x-www-form-urlencoded"}}), 415);
  EXPECT_EQ(status({{"Content-Type", "application/jsonx"}}), 415);
  EXPECT_EQ(status({{"Content-Type", ""}}), 415);
  EXPECT_EQ(status({{"Content-Encoding", "gzip"}}), 415);
  EXPECT_EQ(status({{"Content-Encoding", "identity"}}), 200);
}

TEST_F(Calls, OnlyPagesOfThisServerMayAskForWork) {
  const auto status = [&](const std::string& origin) {
    return post(tiny_request(), {{"Origin", origin}, {"Host", "localhost:8080"}}).status;
  };
  EXPECT_EQ(status("http://localhost:8080"), 200);
  EXPECT_EQ(status("HTTP://LocalHost:8080"), 200);
  EXPECT_EQ(status("http://localhost:9090"), 403);
  EXPECT_EQ(status("http://localhost"), 403);
  EXPECT_EQ(status("http://example.com"), 403);
  EXPECT_EQ(status("http://localhost:8080.example.com"), 403);
  EXPECT_EQ(status("null"), 403);
  EXPECT_EQ(status(""), 403);
  EXPECT_EQ(ask("GET", "/livez", {{"Origin", "http://example.com"}}).status, 200);
  EXPECT_TRUE(ask("GET", "/v1/scenes").header("access-control-allow-origin").empty());
}

TEST_F(Calls, FilesOfThePageAreGivenOutAndNothingElse) {
  const Answer page = ask("GET", "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.header("content-type"), "text/html; charset=utf-8");
  EXPECT_NE(page.header("content-security-policy").find("default-src 'self'"), std::string::npos);
  EXPECT_EQ(page.header("cache-control"), "no-cache");
  EXPECT_EQ(ask("GET", "/index.html").body, page.body);
  EXPECT_EQ(ask("GET", "/?scene=tiny").body, page.body);
  const Answer again = ask("GET", "/", {{"If-None-Match", page.header("etag")}});
  EXPECT_EQ(again.status, 304);
  EXPECT_TRUE(again.body.empty());
  const Answer script = ask("GET", "/assets/page-1a2b3c.js");
  EXPECT_EQ(script.header("content-type"), "text/javascript; charset=utf-8");
  EXPECT_NE(script.header("cache-control").find("immutable"), std::string::npos);
  EXPECT_EQ(ask("GET", "/assets/page%2D1a2b3c.js").status, 200);
  for (const char* path :
       {"/../secret", "/%2e%2e/secret", "/..%2fsecret", "/assets/../../secret", "/.hidden",
        "/%2ehidden", "/link", "/assets", "/assets/", "/assets//page-1a2b3c.js", "/./index.html",
        "/..\\secret", "/%5c..%5csecret", "/index.html/", "/index.html/x", "/%252e%252e/secret",
        "/etc/passwd", "//etc/passwd"}) {
    EXPECT_EQ(ask("GET", path).status, 404) << path;
  }
  for (const char* path : {"/%00", "/index.html%00.js", "/%", "/%2", "/%zz"})
    EXPECT_EQ(ask("GET", path).status, 400) << path;
}

TEST(Tokens, CallsNeedTheTokenAndProbesDoNot) {
  TestServer::Options options;
  options.token = "0123456789abcdef";
  TestServer server(options);
  const auto status = [&](const Headers& headers) {
    return ask(server.port(), "GET", "/v1/scenes", headers).status;
  };
  EXPECT_EQ(status({{"Authorization", "Bearer 0123456789abcdef"}}), 200);
  EXPECT_EQ(status({{"Authorization", "bearer 0123456789abcdef"}}), 200);
  EXPECT_EQ(status({}), 401);
  for (const char* value :
       {"", "Bearer", "Bearer ", "Bearer 0123456789abcdeg", "Bearer 0123456789abcde",
        "Bearer 0123456789abcdef0", "Bearer 0123456789abcdef0123456789abcdef",
        "Basic 0123456789abcdef", "0123456789abcdef"}) {
    EXPECT_EQ(status({{"Authorization", value}}), 401) << value;
  }
  const Answer refused = ask(server.port(), "GET", "/v1/nothing");
  EXPECT_EQ(refused.status, 401) << "who may not ask is not told what there is";
  EXPECT_EQ(refused.header("www-authenticate"), "Bearer realm=\"fstop\"");
  EXPECT_EQ(ask(server.port(), "POST", "/v1/renders", {}, tiny_request()).status, 401);
  for (const char* path : {"/livez", "/readyz", "/openapi.json", "/"})
    EXPECT_EQ(ask(server.port(), "GET", path).status, 200) << path;
  EXPECT_EQ(server.log_text().find("0123456789abcdef"), std::string::npos);
}

TEST(Logs, LinesStayLinesWhateverIsAsked) {
  TestServer server;
  ask(server.port(), "GET", "/%22%0a\"quote\\", {{"User-Agent", "\"}\x1b[31m"}});
  ask(server.port(), "POST", "/v1/renders", {}, "{\"\\u0000\\n\": \"\xff\"}");
  ask(server.port(), "GET", "/" + std::string(3000, 'a'));
  ASSERT_TRUE(eventually(
      [&] { return server.log_text().find("\"status\":404,\"ms\"") != std::string::npos; }));
  std::istringstream lines(server.log_text());
  int requests = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.front(), '{');
    EXPECT_EQ(line.back(), '}');
    EXPECT_LT(line.size(), 3000U);
    for (const char c : line) EXPECT_GE(static_cast<unsigned char>(c), 0x20) << line;
    requests += line.find("\"event\":\"request\"") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(requests, 1);
}

}  // namespace
}  // namespace fstop::test
