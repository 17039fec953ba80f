// The fstop program as people run it: its command line, and a server process under load, signals
// and vanishing clients.
#include "tests/http/program.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <list>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Takes seconds on any machine: a request that is certainly under way when the test acts.
std::string long_request(int seed) {
  return R"({"scene": "still-life", "camera": {"lens": {"focal_length_mm": 50, "f_number": 1.4,
      "focus_distance_m": 2}}, "image": {"width": 960, "height": 640},
      "quality": {"samples": 1024}, "seed": )" +
         std::to_string(seed) + "}";
}

// On a busy machine no render may become a job where a test counts replies.
const Headers kPatient = {{"Prefer", "wait=600"}};

bool has_line(const ServerProcess& server, const std::string& text, int times = 1) {
  return eventually([&] {
    const std::string log = server.log_text();
    int found = 0;
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1))
      ++found;
    return found >= times;
  });
}

class Program : public testing::Test {
 protected:
  void SetUp() override { write_scenes(folder_); }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  TemporaryFolder folder_;
};

TEST_F(Program, PrintsItsVersionAndHelp) {
  EXPECT_EQ(run_fstop({"version"}).output.find("fstop/"), 0U);
  const Outcome help = run_fstop({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.output.find("serve"), std::string::npos);
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{},
                                                {"bake"},
                                                {"serve", "--prot", "1"},
                                                {"serve", "--port", "x"},
                                                {"render", "a.json"}}) {
    const Outcome outcome = run_fstop(wrong);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.output.find("/problems/bad-arguments"), std::string::npos) << outcome.output;
  }
}

TEST_F(Program, OpticsReadsAFileOrStandardInput) {
  const std::string request =
      R"({"camera": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}}})";
  folder_.write("optics.json", request);
  const Outcome from_file = run_fstop({"optics", path("optics.json")});
  EXPECT_EQ(from_file.exit_code, 0);
  EXPECT_NE(from_file.output.find("\"hyperfocal_m\""), std::string::npos) << from_file.output;
  EXPECT_EQ(run_fstop({"optics"}, request).output, from_file.output);
  EXPECT_EQ(run_fstop({"optics", "-"}, request).output, from_file.output);
  const Outcome refused = run_fstop({"optics"}, R"({"camera": {"lens": {"f_number": "wide"}}})");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.output.find("#/camera/lens/f_number"), std::string::npos) << refused.output;
  EXPECT_EQ(run_fstop({"optics", path("none.json")}).exit_code, 2);
}

TEST_F(Program, PsfPrintsNumbersAndWritesTheImageThatTheServerSends) {
  const std::string request = R"({"camera": {"lens": {"f_number": 8, "blades": 6}},
      "object_distance_m": 2.5, "image": {"width": 40, "height": 30, "pixel_um": 2}})";
  folder_.write("psf.json", request);
  const Outcome printed = run_fstop({"psf", path("psf.json")});
  EXPECT_EQ(printed.exit_code, 0);
  EXPECT_NE(printed.output.find("\"encircled_energy\""), std::string::npos) << printed.output;
  EXPECT_EQ(run_fstop({"psf", "-"}, request).output, printed.output);
  ServerProcess server(folder_.path());
  EXPECT_EQ(ask(server.port(), "POST", "/v1/psf", {}, request).body + "\n", printed.output);
  for (const auto& [name, type] :
       {std::pair("psf.exr", "image/x-exr"), {"psf.png", "image/png"}, {"psf.tif", "image/tiff"}}) {
    const Outcome outcome = run_fstop({"psf", path("psf.json"), "--out", path(name)});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
    EXPECT_EQ(outcome.output, printed.output);
    const Answer answer = ask(server.port(), "POST", "/v1/psf", {{"Accept", type}}, request);
    ASSERT_EQ(answer.status, 200) << answer.body;
    EXPECT_TRUE(text_of_file(path(name)) == answer.body) << name;
  }
  const std::string too_oblique = R"({"camera": {"pinhole": {"diameter_mm": 0.35}},
      "field_angle_deg": 80})";
  const int before = folder_.files();
  const Outcome refused = run_fstop({"psf", "-", "--out", path("none.png")}, too_oblique);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.output.find("75 degrees"), std::string::npos) << refused.output;
  EXPECT_EQ(folder_.files(), before);
}

// Layers of all kinds without a server, by the paths of files beside the request.
TEST_F(Program, CompositePutsRendersAndFilesTogether) {
  const std::string camera = R"("camera": {"lens": {"focal_length_mm": 50, "f_number": 4,
      "focus_distance_m": 2}}, "image": {"width": 24, "height": 16}, "quality": {"samples": 4}})";
  const std::string scene = R"({"scene": "scenes/tiny/scene.json", )" + camera;
  folder_.write("card.json", scene);
  ASSERT_EQ(run_fstop({"render", path("card.json"), "--out", path("card.png")}).exit_code, 0);
  folder_.write("stack.json", R"({"layers": [{"image": {"file": "card.png"}}, {"render": )" +
                                  scene + R"(, "opacity": 0.5}], "outputs": ["alpha"]})");
  const Outcome made = run_fstop({"composite", path("stack.json"), "--out", path("stack.exr"),
                                  "--report", path("stack-report.json")});
  ASSERT_EQ(made.exit_code, 0) << made.output << made.errors;
  EXPECT_NE(text_of_file(path("stack-report.json")).find("\"confidence\":0.95"), std::string::npos);
  EXPECT_EQ(text_of_file(path("stack.exr")).substr(1, 3), "\x2f\x31\x01");
  for (
      const char* wrong :
      {R"({"layers": []})", R"({"layers": [{"image": {"file": "none.png"}}]})",
       R"({"layers": [{"image": {"file": "../secret"}}]})",
       R"({"layers": [{"render": "0000000000000000000000000000000000000000000000000000000000000000"}]})"}) {
    folder_.write("wrong.json", wrong);
    const Outcome refused = run_fstop({"composite", path("wrong.json"), "--out", path("none.png")});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.output.find("#/layers"), std::string::npos) << refused.output;
  }
  const Outcome jpeg = run_fstop({"composite", path("stack.json"), "--out", path("none.jpg")});
  EXPECT_EQ(jpeg.exit_code, 2);
  EXPECT_NE(jpeg.output.find("jpeg"), std::string::npos) << jpeg.output;
}

std::string chart_text(int replicates) {
  return R"({"scene": "scenes/tiny/scene.json", "camera": {"lens": {"f_number": 2}},
      "image": {"width": 24, "height": 16}, "samples": [1, 4], "max_errors": [0.1],
      "reference": {"samples": 256, "replicates": )" +
         std::to_string(replicates) + "}}";
}

TEST_F(Program, ChartPrintsNumbersAndWritesTheDrawing) {
  folder_.write("chart.json", chart_text(2));
  const Outcome printed = run_fstop({"chart", path("chart.json"), "--out", path("chart.svg")});
  ASSERT_EQ(printed.exit_code, 0) << printed.output << printed.errors;
  EXPECT_EQ(printed.output.find("{\"reference\":{"), 0U) << printed.output;
  EXPECT_EQ(printed.errors, "");
  EXPECT_EQ(text_of_file(path("chart.svg")).find("<svg xmlns="), 0U);
  const Outcome told = run_fstop(
      {"chart", path("chart.json"), "--out", path("out.json"), "--threads", "2", "--progress"});
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_EQ(text_of_file(path("out.json")), told.output);
  EXPECT_NE(told.output.find("\"threads\":2"), std::string::npos);
  EXPECT_NE(told.errors.find("chart: 100 %\n"), std::string::npos) << told.errors;
  for (const char* out : {"chart.png", "chart"}) {
    const Outcome refused = run_fstop({"chart", path("chart.json"), "--out", path(out)});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.output.find("--out must end in .svg or .json"), std::string::npos);
  }
  EXPECT_EQ(run_fstop({"chart", "-"}, R"({"scene": "tiny"})").exit_code, 2);
}

// Each replicate ends in progress, so that the signal comes while others are still to be made.
TEST_F(Program, ChartIsStoppedBySignalsAndLeavesNothing) {
  std::string request = chart_text(64);
  request.replace(request.find("\"samples\": 256"), 14, "\"samples\": 65536");
  folder_.write("chart.json", request);
  const int before = folder_.files();
  for (const int number : {SIGINT, SIGTERM}) {
    const Outcome stopped =
        run_fstop_until({"chart", path("chart.json"), "--out", path("none.svg"), "--progress"},
                        "chart: 0 %", number);
    EXPECT_EQ(stopped.exit_code, 1);
    EXPECT_NE(stopped.errors.find("stopped by a signal before it was done"), std::string::npos)
        << stopped.errors;
    EXPECT_NE(stopped.output.find("/problems/cancelled"), std::string::npos) << stopped.output;
  }
  EXPECT_EQ(folder_.files(), before);
}

TEST_F(Program, RendersAFileThatEqualsTheServers) {
  std::string request = tiny_request(3);
  request.replace(request.find("\"tiny\""), 6, "\"scenes/tiny/scene.json\"");
  folder_.write("request.json", request);
  ServerProcess server(folder_.path(), {"--scenes-dir", path("scenes")});
  for (const auto& [name, type] : {std::pair("image.png", "image/png"),
                                   {"image.jpg", "image/jpeg"},
                                   {"image.webp", "image/webp"},
                                   {"image.tif", "image/tiff"},
                                   {"image.exr", "image/x-exr"}}) {
    const Outcome outcome = run_fstop(
        {"render", path("request.json"), "--out", path(name), "--report", path("report.json")});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
    EXPECT_TRUE(outcome.output.empty());
    const Answer answer =
        ask(server.port(), "POST", "/v1/renders", {{"Accept", type}}, tiny_request(3));
    ASSERT_EQ(answer.status, 200) << answer.body;
    EXPECT_TRUE(text_of_file(path(name)) == answer.body) << name;
    EXPECT_NE(text_of_file(path("report.json")).find(answer.header("fstop-render-id")),
              std::string::npos);
  }
  const Outcome printed = run_fstop({"render", path("request.json"), "--out", path("image.png")});
  EXPECT_NE(printed.output.find("\"method\""), std::string::npos) << printed.output;
}

TEST_F(Program, RefusalsAreProblemsAndLeaveNoFile) {
  folder_.write("bad.json", R"({"scene": "tiny", "camera": {"lens": {"focal_length_mm": "50"}}})");
  folder_.write("broken.json", R"({"scene": "scenes/broken-mesh/scene.json", "camera": {"lens":
      {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}}})");
  const int before = folder_.files();
  const Outcome bad = run_fstop({"render", path("bad.json"), "--out", path("a.png")});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.output.find("#/camera/lens/focal_length_mm"), std::string::npos) << bad.output;
  const Outcome broken = run_fstop({"render", path("broken.json"), "--out", path("a.png")});
  EXPECT_EQ(broken.exit_code, 2);
  EXPECT_NE(broken.output.find("#/scene"), std::string::npos) << broken.output;
  EXPECT_EQ(run_fstop({"render", path("none.json"), "--out", path("a.png")}).exit_code, 2);
  EXPECT_EQ(folder_.files(), before);
}

TEST_F(Program, FailuresToWriteExitWith1) {
  std::string request = tiny_request(3);
  request.replace(request.find("\"tiny\""), 6, "\"scenes/tiny/scene.json\"");
  folder_.write("request.json", request);
  const int before = folder_.files();
  for (const std::string& out : {path("no/such/folder/a.png"), std::string("/dev/full")}) {
    const Outcome outcome = run_fstop({"render", path("request.json"), "--out", out});
    EXPECT_EQ(outcome.exit_code, 1) << out;
    EXPECT_NE(outcome.output.find("application/problem"), 0U);
    EXPECT_NE(outcome.output.find("\"status\":500"), std::string::npos) << outcome.output;
    EXPECT_FALSE(outcome.errors.empty());
  }
  EXPECT_EQ(folder_.files(), before);
}

TEST_F(Program, ServeRefusesWhatWouldBeOpenToOthers) {
  folder_.write("short", "0123456789\n");
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--address", "0.0.0.0"},
        {"--address", "::"},
        {"--address", "192.0.2.1"},
        {"--address", "not.an.address"},
        {"--address", "0.0.0.0", "--token-file", path("short")},
        {"--threads", "-1"},
        {"--data-dir", path("short")}}) {
    std::vector<std::string> arguments = {"serve", "--port", "0"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const Outcome outcome = run_fstop(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << wrong.back() << outcome.output;
    EXPECT_NE(outcome.output.find("\"detail\":\"--"), std::string::npos)
        << "does not name the option: " << outcome.output;
  }
  EXPECT_EQ(run_fstop({"serve", "--token-file", path("none")}).exit_code, 1);
}

TEST_F(Program, ServesBeyondLoopbackWithAToken) {
  folder_.write("token", "0123456789abcdef\n");
  ServerProcess server(folder_.path(), {"--address", "0.0.0.0", "--token-file", path("token")});
  EXPECT_EQ(ask(server.port(), "GET", "/v1/scenes").status, 401);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/scenes",
                {{"Authorization", "Bearer 0123456789abcdef"}, {"Host", "fstop.example:8080"}})
                .status,
            200);
  const std::string port = std::to_string(server.port());
  EXPECT_EQ(run_fstop({"probe", "--port", port}).exit_code, 0);
  EXPECT_EQ(run_fstop({"serve", "--port", port}).exit_code, 1) << "the port is taken";
  server.signal(SIGINT);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_EQ(run_fstop({"probe", "--port", port}).exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "port"));
}

TEST_F(Program, TermAnswersWhatWasAdmittedAndASecondSignalEndsAtOnce) {
  std::vector<std::string> requests;
  for (int seed = 0; seed < 4; ++seed) {
    requests.push_back(R"({"scene": "still-life", "camera": {"lens": {"focal_length_mm": 50,
        "f_number": 2, "focus_distance_m": 2}}, "image": {"width": 240, "height": 160},
        "quality": {"samples": 16}, "seed": )" +
                       std::to_string(seed) + "}");
  }
  {
    ServerProcess server(folder_.path());
    std::list<Client> clients;
    for (const std::string& request : requests) {
      clients.emplace_back(server.port());
      clients.back().send(request_text("POST", "/v1/renders", kPatient, request));
    }
    ASSERT_TRUE(has_line(server, "\"event\":\"render_start\"", 2));
    std::this_thread::sleep_for(200ms);  // let the others be read as well
    server.signal(SIGTERM);
    for (Client& client : clients) {
      const auto answer = client.read();
      ASSERT_TRUE(answer);
      EXPECT_EQ(answer->status, 200);
      EXPECT_EQ(answer->header("connection"), "close");
      client.close();
    }
    EXPECT_EQ(server.wait(), 0);
  }
  ServerProcess server(folder_.path());
  Client client(server.port());
  client.send(request_text("POST", "/v1/renders", kPatient, long_request(0)));
  ASSERT_TRUE(has_line(server, "\"event\":\"render_start\""));
  server.signal(SIGTERM);
  ASSERT_TRUE(has_line(server, "\"event\":\"draining\""));
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 128 + SIGTERM);
}

TEST_F(Program, VanishedClientsStopTheirRendersAndLeaveNoDescriptors) {
  ServerProcess server(folder_.path());
  {
    // The scene is read before anything is measured.
    Client client(server.port());
    client.send(request_text("POST", "/v1/renders", kPatient, long_request(0)));
    ASSERT_TRUE(has_line(server, "\"event\":\"render_start\""));
    std::this_thread::sleep_for(500ms);
  }
  ASSERT_TRUE(has_line(server, "\"stop_ms\":"));
  const int descriptors = server.open_descriptors();
  constexpr int kClients = 40;
  for (int i = 1; i <= kClients; ++i) {
    Client client(server.port());
    client.send(request_text("POST", "/v1/renders", kPatient, long_request(i)));
    ASSERT_TRUE(has_line(server, "\"event\":\"render_start\"", i + 1));
    std::this_thread::sleep_for(10ms);
    if (i % 2 == 0) client.reset();
  }
  ASSERT_TRUE(has_line(server, "\"stop_ms\":", kClients + 1));
  EXPECT_TRUE(eventually([&] { return server.open_descriptors() <= descriptors; }));
  std::vector<double> times;
  const std::string log = server.log_text();
  constexpr std::string_view kMark = "\"stop_ms\":";
  for (std::size_t at = log.find(kMark); at != std::string::npos; at = log.find(kMark, at + 1))
    times.push_back(std::stod(log.substr(at + kMark.size(), 32)));
  std::sort(times.begin(), times.end());
  std::printf(
      "[          ] stop asked to render ended, %zu renders: median %.1f ms, most %.1f ms\n",
      times.size(), times[times.size() / 2], times.back());
  EXPECT_EQ(ask(server.port(), "GET", "/readyz").status, 200);
}

// Every core renders, more renders wait; the probe must not notice. Asserts that every probe is
// answered; how fast goes to the output.
TEST_F(Program, LivezAnswersWhileEveryCoreRenders) {
  ServerProcess server(folder_.path());
  std::list<Client> clients;
  for (int seed = 0; seed < 8; ++seed) {
    clients.emplace_back(server.port());
    clients.back().send(request_text("POST", "/v1/renders", kPatient, long_request(seed)));
  }
  ASSERT_TRUE(has_line(server, "\"event\":\"render_start\"", 2));
  std::this_thread::sleep_for(1s);  // past the building of the scene: rays on every core
  std::vector<double> times_ms;
  Client kept(server.port());
  for (int i = 0; i < 2000; ++i) {
    const auto start = Clock::now();
    const int status =
        i % 2 == 0 ? kept.ask("GET", "/livez").status : ask(server.port(), "GET", "/livez").status;
    times_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
    ASSERT_EQ(status, 200);
    std::this_thread::sleep_for(1ms);
  }
  std::sort(times_ms.begin(), times_ms.end());
  const auto quantile = [&](double share) {
    return times_ms[static_cast<std::size_t>(share * static_cast<double>(times_ms.size() - 1))];
  };
  std::printf(
      "[          ] /livez under load, %zu probes: p50 %.2f ms, p99 %.2f ms, p99.9 %.2f ms\n",
      times_ms.size(), quantile(0.5), quantile(0.99), quantile(0.999));
  EXPECT_EQ(server.log_text().find("\"event\":\"render\","), std::string::npos)
      << "the load ended before the probes did";
}

}  // namespace
}  // namespace fstop::test
