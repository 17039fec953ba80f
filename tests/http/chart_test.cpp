// POST /v1/charts: numbers, drawing or events by Accept, refusals, limits, and clients that leave.
#include <list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

// Pictures of the scene "tiny"; `samples` of the reference decide how long it takes.
std::string chart_request(int samples = 16, int seed = 0, const std::string& members = {}) {
  return R"({"scene": "tiny", "camera": {"lens": {"focal_length_mm": 50, "f_number": 2,
      "focus_distance_m": 2}}, "image": {"width": 24, "height": 16},
      "methods": ["pinhole", "lens-sampling"], "samples": [1, 4], "max_errors": [0.1],
      "reference": {"samples": )" +
         std::to_string(samples) + R"(, "replicates": 2}, "seed": )" + std::to_string(seed) +
         members + "}";
}

// Certainly under way when a test acts: minutes of it, if nobody stopped it.
std::string endless_request(int seed) {
  std::string request = chart_request(65'536, seed);
  request.replace(request.find("\"replicates\": 2"), 15, "\"replicates\": 64");
  return request;
}

class Charts : public testing::Test {
 protected:
  Answer post(const std::string& body, const Headers& headers = {}) {
    return ask(server_.port(), "POST", "/v1/charts", headers, body);
  }
  Client& asking(const std::string& body, const Headers& headers = {}) {
    clients_.emplace_back(server_.port());
    clients_.back().send(request_text("POST", "/v1/charts", headers, body));
    return clients_.back();
  }
  server::RenderQueue::Counts counts() { return server_.server().chart_counts(); }
  bool reaches(int running, int queued) {
    return eventually([&] { return counts().running == running && counts().queued == queued; });
  }
  TestServer server_;
  std::list<Client> clients_;
};

TEST_F(Charts, AnswersNumbersOrADrawing) {
  const Answer numbers = post(chart_request());
  ASSERT_EQ(numbers.status, 200) << numbers.body;
  EXPECT_EQ(numbers.header("content-type"), "application/json");
  EXPECT_EQ(numbers.header("vary"), "Accept");
  for (const char* member : {"\"reference\":{\"method\":\"lens-sampling\"", "\"points\":[{",
                             "\"picks\":[{\"max_error\":0.1", "\"true_error\":{\"rmse\":",
                             "\"passed_over\":", "\"threads\":1", "\"request\":{"}) {
    EXPECT_NE(numbers.body.find(member), std::string::npos) << member << numbers.body;
  }
  const Answer drawing = post(chart_request(), {{"Accept", "image/svg+xml"}});
  ASSERT_EQ(drawing.status, 200) << drawing.body;
  EXPECT_EQ(drawing.header("content-type"), "image/svg+xml");
  EXPECT_EQ(drawing.body.find("<svg xmlns="), 0U);
  EXPECT_NE(drawing.body.find("Time against true error: tiny</text>"), std::string::npos);
  for (const auto& [accept, type] : {std::pair("*/*", "application/json"),
                                     {"image/*, */*;q=0.5", "image/svg+xml"},
                                     {"application/json, image/svg+xml", "application/json"}}) {
    EXPECT_EQ(post(chart_request(), {{"Accept", accept}}).header("content-type"), type) << accept;
  }
  EXPECT_EQ(post(chart_request(), {{"Accept", "image/png"}}).status, 406);
}

// Progress that never falls, then the numbers that the plain reply has, times apart.
TEST_F(Charts, TellsProgressAsEvents) {
  Client client(server_.port());
  const Answer answer =
      client.ask("POST", "/v1/charts", {{"Accept", "text/event-stream"}}, chart_request(512));
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "text/event-stream");
  EXPECT_EQ(answer.header("transfer-encoding"), "chunked");
  EXPECT_EQ(answer.header("content-length"), "");
  EXPECT_EQ(answer.body.find("event: progress\ndata: {\"progress\":0}\n\n"), 0U) << answer.body;
  double told = -1.0;
  const std::string mark = "{\"progress\":";
  for (auto at = answer.body.find(mark); at != std::string::npos;
       at = answer.body.find(mark, at + 1)) {
    const double share = std::stod(answer.body.substr(at + mark.size()));
    EXPECT_GT(share, told);
    EXPECT_LE(share, 1.0);
    told = share;
  }
  const auto last = answer.body.rfind("event: ");
  EXPECT_EQ(answer.body.find("event: chart\ndata: {\"reference\":{"), last);
  EXPECT_TRUE(answer.body.ends_with("}\n\n"));
  EXPECT_EQ(client.ask("GET", "/livez").status, 200) << "the connection goes on";
}

// HTTP/1.0 has no chunks: the events then end with the connection.
TEST_F(Charts, SendsEventsWithoutChunksToOldClients) {
  Client client(server_.port());
  const std::string body = chart_request();
  client.send(
      "POST /v1/charts HTTP/1.0\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
      "Accept: text/event-stream\r\nContent-Length: " +
      std::to_string(body.size()) + "\r\n\r\n" + body);
  const auto answer = client.read_to_end();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(answer->header("transfer-encoding"), "");
  EXPECT_EQ(answer->header("connection"), "close");
  EXPECT_EQ(answer->body.find("event: progress\n"), 0U) << answer->body;
  EXPECT_NE(answer->body.find("event: chart\n"), std::string::npos);
}

TEST_F(Charts, RefusesWithPointers) {
  struct Case {
    std::string body;
    int status;
    const char* text;
  };
  const std::vector<Case> table = {
      {"{", 400, "json-invalid"},
      {R"({"scene": "tiny", "camera": {"lens": {}}, "samples": [1, 0]})", 422, "#/samples/1"},
      {R"({"scene": "gone", "camera": {"lens": {}}})", 422, "#/scene"},
      {R"({"scene": "scene.json", "camera": {"lens": {}}})", 422, "#/scene"},
      {chart_request(16, 0, R"(, "image": {"width": 3000, "height": 2000})"), 400, "image"},
      {R"({"scene": "tiny", "camera": {"lens": {}}, "image": {"width": 3000, "height": 2000}})",
       422, "over-budget"},
  };
  for (const Case& test : table) {
    for (const char* accept : {"application/json", "image/svg+xml", "text/event-stream"}) {
      const Answer answer = post(test.body, {{"Accept", accept}});
      EXPECT_EQ(answer.status, test.status) << test.body;
      EXPECT_EQ(answer.header("content-type"), "application/problem+json");
      EXPECT_NE(answer.body.find(test.text), std::string::npos) << answer.body;
    }
  }
  EXPECT_EQ(counts().started, 0U);
}

TEST_F(Charts, StopWhenTheirClientsHaveGone) {
  Client& plain = asking(endless_request(1));
  ASSERT_TRUE(reaches(1, 0));
  plain.close();
  ASSERT_TRUE(reaches(0, 0));
  EXPECT_EQ(counts().withdrawn, 1U);
  Client& listening = asking(endless_request(2), {{"Accept", "text/event-stream"}});
  ASSERT_TRUE(eventually([&] { return counts().started == 2; }));
  listening.reset();
  ASSERT_TRUE(reaches(0, 0));
  EXPECT_EQ(counts().withdrawn, 2U);
  EXPECT_TRUE(eventually(
      [&] { return server_.log_text().find("chart_ended_early") != std::string::npos; }));
}

TEST_F(Charts, RunOneAtATimeBesideTheRenders) {
  asking(endless_request(1));
  ASSERT_TRUE(reaches(1, 0));
  asking(endless_request(2));
  Client& third = asking(endless_request(3));
  ASSERT_TRUE(reaches(1, 2));  // limits.queued_charts
  const Answer refused = post(endless_request(4));
  EXPECT_EQ(refused.status, 503);
  EXPECT_NE(refused.body.find("/problems/queue-full"), std::string::npos) << refused.body;
  EXPECT_GE(std::stoi(refused.header("retry-after")), 1);
  asking(endless_request(1));  // an equal one shares what runs
  ASSERT_TRUE(eventually([&] { return counts().joined == 1; }));
  // Renders have threads and places of their own.
  EXPECT_EQ(ask(server_.port(), "POST", "/v1/renders", {}, tiny_request()).status, 200);
  third.close();
  ASSERT_TRUE(reaches(1, 1));
  for (Client& client : clients_) client.close();
  EXPECT_TRUE(reaches(0, 0));
  EXPECT_EQ(counts().started, 1U);
}

}  // namespace
}  // namespace fstop::test
