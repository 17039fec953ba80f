// Scenes that clients send: stored whole or not at all, read by a process that can do no harm.
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <string>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "server/sandbox.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"
#include "tests/references/zip_writer.h"

namespace fstop::test {
namespace {

std::string scene_text(const std::string& red) {
  return R"({"format": "fstop-scene/1",
    "materials": {"m": {"model": "unlit", "emission": [)" +
         red + R"(, 0, 0]}},
    "objects": [{"type": "mesh", "file": "one.obj", "material": "m"}]})";
}

std::string archive(const std::string& red = "1") {
  return zip_of(
      {{"scene.json", scene_text(red)}, {"one.obj", "v -9 -9 -3\nv 9 -9 -3\nv 0 9 -3\nf 1 2 3\n"}});
}

class SceneUploads : public testing::Test {
 protected:
  static TestServer::Options options() {
    TestServer::Options options;
    options.takes_scenes = true;
    return options;
  }
  Answer put(const std::string& name, const std::string& body,
             const std::string& type = "application/zip") {
    return ask(server_.port(), "PUT", "/v1/scenes/" + name, {{"Content-Type", type}}, body);
  }
  Answer render(const std::string& scene) {
    return ask(server_.port(), "POST", "/v1/renders", {}, R"({"scene": ")" + scene + R"(",
        "camera": {"lens": {"f_number": 8, "focus_distance_m": 3}},
        "image": {"width": 24, "height": 16}, "quality": {"samples": 2}})");
  }
  TestServer server_{options()};
};

TEST_F(SceneUploads, AreStoredPhotographedAndReplaced) {
  const Answer stored = put("mine", archive());
  ASSERT_EQ(stored.status, 201) << stored.body;
  EXPECT_EQ(stored.header("location"), "/v1/scenes/mine");
  EXPECT_EQ(ask(server_.port(), "GET", "/v1/scenes/mine").body, scene_text("1"));
  EXPECT_NE(ask(server_.port(), "GET", "/v1/scenes").body.find("\"mine\""), std::string::npos);
  const Answer picture = render("mine");
  ASSERT_EQ(picture.status, 200) << picture.body;
  const Answer replaced = put("mine", archive("0.5"));
  EXPECT_EQ(replaced.status, 200) << replaced.body;
  EXPECT_EQ(ask(server_.port(), "GET", "/v1/scenes/mine").body, scene_text("0.5"));
  const Answer another = render("mine");
  ASSERT_EQ(another.status, 200);
  EXPECT_NE(another.header("fstop-render-id"), picture.header("fstop-render-id"));
  EXPECT_NE(another.body, picture.body);
}

TEST_F(SceneUploads, ScenesOfTheServerStayAsTheyAre) {
  const std::string before = ask(server_.port(), "GET", "/v1/scenes/tiny").body;
  const Answer refused = put("tiny", archive());
  EXPECT_EQ(refused.status, 409);
  EXPECT_NE(refused.body.find("bundled-scene"), std::string::npos);
  EXPECT_EQ(ask(server_.port(), "GET", "/v1/scenes/tiny").body, before);
}

TEST_F(SceneUploads, AGlbIsPhotographed) {
  const Answer stored = put("model", small_glb(), "model/gltf-binary");
  ASSERT_EQ(stored.status, 201) << stored.body;
  EXPECT_EQ(render("model").status, 200);
}

TEST_F(SceneUploads, WhatIsRefusedLeavesNothing) {
  const int before = server_.folder().files();
  struct Case {
    std::string name;
    std::string body;
    std::string type;
    int status;
    const char* text;
  };
  const std::string good = archive();
  for (const Case& wrong : std::vector<Case>{
           {"Bad", good, "application/zip", 422, "bad-name"},
           {"a.b", good, "application/zip", 422, "bad-name"},
           {"%2e%2e", good, "application/zip", 422, "bad-name"},
           {"a", good, "application/json", 415, "unsupported-media-type"},
           {"a", good, "application/octet-stream", 415, "unsupported-media-type"},
           {"a", "no archive", "application/zip", 422, "unsupported"},
           {"a", good.substr(0, 100), "application/zip", 422, "invalid-request"},
           {"a", zip_of({{"scene.json", scene_text("1")}}), "application/zip", 422,
            "#/objects/0/file"},
           {"a", zip_of({{"scene.json", scene_text("x")}}), "application/zip", 400, "json-invalid"},
           {"a", zip_of({{"../scene.json", scene_text("1")}}), "application/zip", 422, "bad-path"},
           {"a", zip_of({{"scene.json", std::string(30'000'000, ' ')}}), "application/zip", 422,
            "over-budget"},
           {"a", small_glb().substr(0, 40), "model/gltf-binary", 422, "bad-geometry"}}) {
    const Answer answer = put(wrong.name, wrong.body, wrong.type);
    EXPECT_EQ(answer.status, wrong.status) << wrong.text << '\n' << answer.body;
    EXPECT_NE(answer.body.find(wrong.text), std::string::npos) << answer.body;
  }
  EXPECT_EQ(server_.folder().files(), before);
  Client client(server_.port());
  client.send(
      "PUT /v1/scenes/a HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/zip\r\n"
      "Content-Length: 67108865\r\n\r\n");
  const auto large = client.read();
  ASSERT_TRUE(large);
  EXPECT_EQ(large->status, 413) << "before it is read";
  EXPECT_EQ(put("fine", good).status, 201);
}

TEST_F(SceneUploads, BodiesAreNotReadWhileTooManyAreThere) {
  const std::string head =
      "PUT /v1/scenes/a HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/zip\r\n"
      "Content-Length: 1000000\r\n\r\n";
  std::vector<Client> holding;
  for (int i = 0; i < 4; ++i) {
    holding.emplace_back(server_.port());
    holding.back().send(head + "half");
  }
  EXPECT_TRUE(eventually([&] {
    Client client(server_.port());
    client.send(head);
    const auto answer = client.read(false, std::chrono::milliseconds(200));
    return answer && answer->status == 503;
  }));
  holding.clear();
  EXPECT_TRUE(eventually([&] { return put("a", archive()).status < 300; }));
}

TEST(SceneUploadsOff, WithoutADataDirectoryThereIsNoPut) {
  TestServer server;
  const Answer answer =
      ask(server.port(), "PUT", "/v1/scenes/a", {{"Content-Type", "application/zip"}}, archive());
  EXPECT_EQ(answer.status, 503);
  EXPECT_NE(answer.body.find("no-data-dir"), std::string::npos) << answer.body;
}

// What a child that is locked in exits with: 0 where `forbidden` says that it could not.
int locked_in(const std::function<bool()>& forbidden) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      server::enter_sandbox({.memory_bytes = std::size_t{1} << 30, .cpu_s = 1});
    } catch (...) {
      ::_exit(99);
    }
    ::_exit(forbidden() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

TEST(Sandbox, LetsNothingOut) {
  TemporaryFolder folder;
  folder.write("there", "x");
  const std::string there = (folder.path() / "there").string();
  const std::string fresh = (folder.path() / "fresh").string();
  EXPECT_EQ(locked_in([] { return ::socket(AF_INET, SOCK_STREAM, 0) < 0; }), 0);
  EXPECT_EQ(locked_in([] { return ::socket(AF_UNIX, SOCK_STREAM, 0) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::open(fresh.c_str(), O_CREAT | O_WRONLY, 0600) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::open(there.c_str(), O_WRONLY) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::open(there.c_str(), O_RDWR) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::creat(fresh.c_str(), 0600) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::unlink(there.c_str()) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::rename(there.c_str(), fresh.c_str()) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::symlink("a", fresh.c_str()) < 0; }), 0);
  EXPECT_EQ(locked_in([&] { return ::mkdir(fresh.c_str(), 0700) < 0; }), 0);
  EXPECT_EQ(locked_in([] { return ::fork() < 0; }), 0);
  EXPECT_EQ(locked_in([] { return ::execl("/bin/true", "true", nullptr) < 0; }), 0);
  EXPECT_EQ(locked_in([] { return ::kill(::getppid(), 0) < 0; }), 0);
  EXPECT_EQ(locked_in([] { return ::memfd_create("a", 0) < 0; }), 0);
  EXPECT_EQ(locked_in([] {
              return ::mmap(nullptr, std::size_t{2} << 30, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS,
                            -1, 0) == MAP_FAILED;
            }),
            0);
  EXPECT_EQ(locked_in([] {
              for (volatile unsigned zero = 0; zero == 0;) {
              }
              return false;
            }),
            128 + SIGKILL)
      << "processor time";
  EXPECT_EQ(locked_in([&] { return ::open(there.c_str(), O_RDONLY) >= 0; }), 0) << "may be read";
  EXPECT_TRUE(std::filesystem::exists(there));
  EXPECT_EQ(folder.files(), 1);
}

TEST(Sandbox, ProgramsThatDoNotEndAreEnded) {
  const server::SandboxAnswer slow =
      server::run_apart("/bin/sleep", {"100"}, {}, {.wall = std::chrono::milliseconds(100)});
  EXPECT_TRUE(slow.timed_out);
  EXPECT_EQ(slow.exit_code, 128 + SIGKILL);
  const std::string input(100'000, 'x');
  const server::SandboxAnswer echoed = server::run_apart("/bin/cat", {}, input, {});
  EXPECT_EQ(echoed.exit_code, 0);
  EXPECT_EQ(echoed.output, input);
  const server::SandboxAnswer wordy =
      server::run_apart("/bin/cat", {}, input, {.answer_bytes = 1000});
  EXPECT_EQ(wordy.exit_code, 128 + SIGKILL);
  EXPECT_EQ(server::run_apart("/bin/false", {}, {}, {}).exit_code, 1);
  EXPECT_THROW(server::run_apart("/no/such/program", {}, {}, {}), Error);
}

}  // namespace
}  // namespace fstop::test
