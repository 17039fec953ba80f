// A server process as operators run it: configuration, probes, kills at any instant, signed URLs.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/http/http_client.h"
#include "tests/http/program.h"
#include "tests/http/test_server.h"
#include "tests/references/zip_writer.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;

class Operations : public testing::Test {
 protected:
  void SetUp() override { write_scenes(folder_); }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  TemporaryFolder folder_;
};

// Whatever was acknowledged is there after a kill at any instant, with the same bytes; what was not
// is made anew.
TEST_F(Operations, KillsLoseNoAcknowledgedResult) {
  constexpr int kKills = 12;
  std::vector<std::pair<std::string, std::string>> acknowledged;  // id, picture
  int seed = 0;
  for (int kill = 0; kill < kKills; ++kill) {
    std::filesystem::remove(path("port"));  // of the killed one
    ServerProcess server(folder_.path(), {"--data-dir", path("data"), "--scenes-dir",
                                          path("scenes"), "--synchronous-s", "600"});
    for (const auto& [id, picture] : acknowledged) {
      const Answer kept = ask(server.port(), "GET", "/v1/renders/" + id + "/image");
      ASSERT_EQ(kept.status, 200) << "lost after kill " << kill;
      ASSERT_TRUE(kept.body == picture);
    }
    // Every second kill comes after an answer, however slow the machine is.
    std::atomic<bool> has_answered = kill % 2 == 0;
    std::thread killer([&] {
      for (int i = 0; i < 2000 && !has_answered; ++i) std::this_thread::sleep_for(5ms);
      std::this_thread::sleep_for(std::chrono::milliseconds(7 * kill + 3));
      server.signal(SIGKILL);
    });
    try {
      Client client(server.port());
      for (;;) {
        client.send(request_text("POST", "/v1/renders", {}, tiny_request(++seed)));
        const auto answer = client.read();
        if (!answer || answer->status != 200) break;
        acknowledged.emplace_back(answer->header("fstop-render-id"), answer->body);
        has_answered = true;
      }
    } catch (const std::runtime_error&) {  // nobody listens any more
    }
    killer.join();
    EXPECT_EQ(server.wait(), 128 + SIGKILL);
  }
  EXPECT_GT(acknowledged.size(), 0U);
  std::printf("[          ] %d kills, %zu acknowledged results, none lost\n", kKills,
              acknowledged.size());
}

TEST_F(Operations, TermFinishesAcceptedJobsWithoutAConnection) {
  std::string job_render;
  {
    ServerProcess server(folder_.path(),
                         {"--data-dir", path("data"), "--scenes-dir", path("scenes")});
    std::string request = tiny_request(1);
    request.replace(request.find("\"samples\": 16"), 13, "\"samples\": 4096");
    const Answer accepted =
        ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}}, request);
    ASSERT_EQ(accepted.status, 202) << accepted.body;
    job_render = accepted.header("fstop-render-id");
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0);
  }
  ServerProcess server(folder_.path(),
                       {"--data-dir", path("data"), "--scenes-dir", path("scenes")});
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + job_render).status, 200);
}

TEST_F(Operations, OptionsComeFromFlagsEnvironmentAndFile) {
  folder_.write("config", "# of the house\ndata-dir = " + path("data") +
                              "\nconcurrent-renders = 3\nsynchronous-s = 7\n");
  ::setenv("FSTOP_SYNCHRONOUS_S", "5", 1);
  {
    ServerProcess server(folder_.path(), {"--config", path("config"), "--queued-renders", "9"});
    const std::string limits = ask(server.port(), "GET", "/v1/limits").body;
    EXPECT_NE(limits.find("\"concurrent_renders\":3"), std::string::npos) << "the file: " << limits;
    EXPECT_NE(limits.find("\"synchronous_s\":5.0"), std::string::npos) << "the environment";
    EXPECT_NE(limits.find("\"queued_renders\":9,"), std::string::npos) << "the flag";
    EXPECT_TRUE(std::filesystem::is_directory(path("data/results")));
  }
  ::unsetenv("FSTOP_SYNCHRONOUS_S");
  folder_.write("wrong", "concurent-renders = 3\n");
  const Outcome refused = run_fstop({"serve", "--port", "0", "--config", path("wrong")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.output.find("line 1"), std::string::npos) << refused.output;
}

TEST_F(Operations, WrongOptionsAreToldBeforeThePortOpens) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--concurrent-renders", "0"},
        {"--queued-renders", "-1"},
        {"--synchronous-s", "601"},
        {"--synchronous-s", "nan"},
        {"--drain-s", "-1"},
        {"--cache-mib", "0"},
        {"--memory-mib", "0"},
        {"--cors-origin", "*"},
        {"--cors-origin", "https://a.example/path"},
        {"--cors-origin", "ftp://a.example"},
        {"--allow-host", "a.example:80"},
        {"--allow-host", "*"},
        {"--data-dir", "/proc/none"}}) {
    std::vector<std::string> arguments = {"serve", "--port", "0"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const Outcome outcome = run_fstop(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << wrong[0] << ' ' << wrong[1];
    EXPECT_NE(outcome.output.find("\"detail\":\"--"), std::string::npos) << outcome.output;
  }
}

TEST_F(Operations, AMissingConfigFileIsAFailure) {
  EXPECT_EQ(run_fstop({"serve", "--config", path("none")}).exit_code, 1);
}

TEST_F(Operations, ProbesHaveAPortAndSignedUrlsOpenWithoutTheToken) {
  folder_.write("token", "0123456789abcdef\n");
  folder_.write("key", "a key of sixteen or more\n" + std::string());
  const Outcome blanks = run_fstop({"sign", "/v1/limits", "--url-key-file", path("key")});
  EXPECT_EQ(blanks.exit_code, 2) << "a key has no blanks";
  folder_.write("key", "a-key-of-sixteen-or-more\n");
  ServerProcess server(
      folder_.path(), {"--token-file", path("token"), "--url-key-file", path("key"), "--probe-port",
                       "0", "--probe-port-file", path("probes")});
  const auto probes = static_cast<std::uint16_t>(std::stoi(text_of_file(path("probes"))));
  EXPECT_EQ(ask(probes, "GET", "/metrics").status, 200);
  EXPECT_EQ(ask(server.port(), "GET", "/metrics").status, 401);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/limits").status, 401);
  const Outcome made = run_fstop({"sign", "/v1/limits", "--url-key-file", path("key")});
  ASSERT_EQ(made.exit_code, 0);
  const std::string target = made.output.substr(0, made.output.find('\n'));
  EXPECT_EQ(ask(server.port(), "GET", target).status, 200) << target;
}

TEST_F(Operations, ScenesAreReadApart) {
  ServerProcess server(folder_.path(), {"--data-dir", path("data")});
  const Answer stored = ask(server.port(), "PUT", "/v1/scenes/model",
                            {{"Content-Type", "model/gltf-binary"}}, small_glb());
  EXPECT_EQ(stored.status, 201) << stored.body;
  EXPECT_TRUE(std::filesystem::exists(path("data/scenes/model/model.glb")));
}

}  // namespace
}  // namespace fstop::test
