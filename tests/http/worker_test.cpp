// Renders in processes of their own: what their deaths take with them, and what they do not.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "server/worker_messages.h"
#include "tests/http/http_client.h"
#include "tests/http/program.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// Seconds of work on any machine, so that it is under way when the test acts.
std::string long_request(int seed) {
  return R"({"scene": "tiny", "camera": {"lens": {"focal_length_mm": 50, "f_number": 2,
      "focus_distance_m": 2}}, "image": {"width": 96, "height": 64},
      "quality": {"samples": 4096}, "seed": )" +
         std::to_string(seed) + "}";
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

int times(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

struct ProcessTimes {
  std::string name = {};
  pid_t parent = -1;
  char state = '?';
  long ticks = 0;  // of the processor
};

ProcessTimes times_of(const fs::path& folder) {
  const std::string text = text_of_file(folder / "stat");
  const std::size_t open = text.find('(');
  const std::size_t close = text.rfind(')');
  if (close == std::string::npos) return {};
  ProcessTimes result{.name = text.substr(open + 1, close - open - 1)};
  std::istringstream rest(text.substr(close + 1));
  std::string skipped;
  long system = 0;
  rest >> result.state >> result.parent;
  for (int i = 0; i < 9; ++i) rest >> skipped;
  rest >> result.ticks >> system;
  result.ticks += system;
  return result;
}

// Processor time of each living worker of `parent`.
std::map<pid_t, long> workers_of(pid_t parent) {
  std::map<pid_t, long> workers;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string number = entry.path().filename().string();
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    const ProcessTimes process = times_of(entry.path());
    if (process.parent == parent && process.name == "fstop-worker" && process.state != 'Z')
      workers[std::stoi(number)] = process.ticks;
  }
  return workers;
}

// The worker that works most just now, of those that `others` does not name.
pid_t busiest(const std::map<pid_t, long>& others = {}) {
  constexpr long kAtLeast = 10;  // ticks: 0.1 s
  const std::map<pid_t, long> before = workers_of(::getpid());
  pid_t found = -1;
  eventually([&] {
    for (const auto& [process, ticks] : workers_of(::getpid())) {
      const auto known = before.find(process);
      const long since = ticks - (known == before.end() ? 0 : known->second);
      if (since >= kAtLeast && !others.contains(process)) found = process;
    }
    return found > 0;
  });
  return found;
}

TestServer::Options options_with(int workers, int express) {
  TestServer::Options options;
  options.limits.concurrent_renders = workers;
  options.limits.express_renders = express;
  return options;
}

Answer render(TestServer& server, const std::string& request) {
  return ask(server.port(), "POST", "/v1/renders", {{"Accept", "image/x-exr"}}, request);
}

void begin(Client& client, const std::string& request) {
  client.send(request_text("POST", "/v1/renders", {{"Accept", "image/x-exr"}}, request));
}

TEST(Workers, MakeThePicturesThatThisProcessWouldMake) {
  TestServer apart;
  TestServer::Options here;
  here.simulate = [](const SimulationSpec& spec, const RayScene& scene, const RunControl& run) {
    return simulate(spec, scene, run);
  };
  TestServer together(here);
  const std::string pinhole = R"({"scene": "tiny", "camera": {"pinhole": {"diameter_mm": 0.3}},
      "image": {"width": 45, "height": 30}, "outputs": ["depth", "normal", "variance"],
      "quality": {"max_error": 0.05}, "seed": 7})";
  for (const std::string& request : {tiny_request(3), pinhole}) {
    const Answer a = render(apart, request);
    const Answer b = render(together, request);
    ASSERT_EQ(a.status, 200) << a.body;
    ASSERT_EQ(b.status, 200) << b.body;
    EXPECT_TRUE(a.body == b.body) << "the pictures differ";
    const std::string report = "/v1/renders/" + a.header("fstop-render-id");
    const auto without_times = [](const std::string& text) {
      return std::regex_replace(text, std::regex(R"("[a-z]+_ms":[0-9.e-]+)"), "");
    };
    EXPECT_EQ(without_times(ask(apart.port(), "GET", report).body),
              without_times(ask(together.port(), "GET", report).body));
  }
  EXPECT_EQ(apart.server().worker_counts().builds, 1U) << "one worker had the scene";
}

// Scenes that two renders at once built, after two one after the other.
std::uint64_t builds_of_two_at_once() {
  TestServer server(options_with(2, 0));
  EXPECT_TRUE(eventually([&] { return server.server().worker_counts().workers == 2; }));
  for (int seed = 1; seed <= 2; ++seed) EXPECT_EQ(render(server, tiny_request(seed)).status, 200);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  Client one(server.port());
  Client other(server.port());
  begin(one, long_request(1));
  begin(other, long_request(2));
  EXPECT_TRUE(one.read() && other.read());
  return server.server().worker_counts().builds;
}

// The second picture of a scene tells the other workers of it: they build it while they rest, and
// no job of theirs does. On a busy machine a job may come before they have begun.
TEST(Workers, ScenesThatAreAskedForAgainAreBuiltByThoseThatRest) {
  std::uint64_t builds = builds_of_two_at_once();
  for (int more = 0; more < 4 && builds != 1; ++more) builds = builds_of_two_at_once();
  EXPECT_EQ(builds, 1U);
}

TEST(Workers, ADeathTakesOneAttemptOfOneRenderWithIt) {
  TestServer undisturbed(options_with(2, 0));
  const std::string first = render(undisturbed, long_request(1)).body;
  const std::string second = render(undisturbed, long_request(2)).body;
  TestServer server(options_with(2, 1));
  ASSERT_TRUE(eventually([&] { return server.server().worker_counts().workers == 3; }));
  Client struck(server.port());
  begin(struck, long_request(1));
  const pid_t worker = busiest();
  ASSERT_GT(worker, 0);
  Client beside(server.port());
  begin(beside, long_request(2));
  Client canary(server.port());
  ASSERT_EQ(::kill(worker, SIGKILL), 0);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(canary.ask("GET", "/livez").status, 200);
    EXPECT_EQ(canary.ask("GET", "/readyz").status, 200);
  }
  EXPECT_TRUE(eventually([&] { return server.server().worker_counts().deaths == 1; }));
  const auto a = struck.read();
  const auto b = beside.read();
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->status, 200) << a->body;
  ASSERT_EQ(b->status, 200) << b->body;
  EXPECT_TRUE(a->body == first) << "not the bytes of an undisturbed render";
  EXPECT_TRUE(b->body == second) << "not the bytes of an undisturbed render";
  EXPECT_TRUE(eventually([&] { return has(server.log_text(), "\"how\":\"signal 9\""); }));
  EXPECT_EQ(times(server.log_text(), "\"event\":\"render_lost\""), 1);
  EXPECT_TRUE(eventually([&] { return server.server().worker_counts().workers == 3; }));
  EXPECT_TRUE(has(ask(server.port(), "GET", "/metrics").body, "\nfstop_worker_deaths_total 1\n"));
}

TEST(Workers, ASecondDeathFailsTheRenderAndNothingElse) {
  TestServer server(options_with(1, 0));
  const Answer accepted =
      ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}}, long_request(4));
  ASSERT_EQ(accepted.status, 202) << accepted.body;
  std::map<pid_t, long> dead;
  for (const int number : {SIGKILL, SIGSEGV}) {
    const pid_t worker = busiest(dead);
    ASSERT_GT(worker, 0);
    ASSERT_EQ(::kill(worker, number), 0);
    dead[worker] = 0;
  }
  const std::string job = accepted.header("location");
  const auto state = [&] { return ask(server.port(), "GET", job).body; };
  ASSERT_TRUE(eventually([&] { return has(state(), "\"state\":\"failed\""); })) << state();
  EXPECT_TRUE(has(state(), "/problems/worker-died")) << state();
  EXPECT_TRUE(has(state(), "\"status\":500")) << state();
  EXPECT_EQ(server.server().worker_counts().deaths, 2U);
  EXPECT_EQ(times(server.log_text(), "\"event\":\"render_lost\""), 2);
  EXPECT_EQ(render(server, tiny_request(1)).status, 200);
}

TEST(Workers, IdleOnesThatDieAreReplacedAtOnce) {
  TestServer server(options_with(1, 1));
  ASSERT_TRUE(eventually([&] { return workers_of(::getpid()).size() == 2; }));
  const std::map<pid_t, long> first = workers_of(::getpid());
  for (const auto& [process, ticks] : first) ASSERT_EQ(::kill(process, SIGKILL), 0);
  EXPECT_TRUE(eventually([&] {
    const auto now = workers_of(::getpid());
    return now.size() == 2 && !now.contains(first.begin()->first);
  }));
  EXPECT_EQ(server.server().worker_counts().deaths, 2U);
  EXPECT_EQ(render(server, tiny_request(1)).status, 200);
  EXPECT_EQ(times(server.log_text(), "\"event\":\"render_lost\""), 0) << "no render was there";
}

// A terminal's Ctrl-C and service managers signal the whole group: the server drains with its
// workers at work.
TEST(Workers, LeaveTheEndToTheServer) {
  TestServer server(options_with(1, 0));
  Client client(server.port());
  begin(client, long_request(5));
  const pid_t worker = busiest();
  ASSERT_GT(worker, 0);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ASSERT_EQ(::kill(worker, number), 0);
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200) << answer->body;
  EXPECT_EQ(server.server().worker_counts().deaths, 0U);
}

TEST(Workers, EndWithTheServerAndShowNoSocketOfItsOwn) {
  TemporaryFolder folder;
  write_scenes(folder);
  ServerProcess server(folder.path(), {"--scenes-dir", (folder.path() / "scenes").string()});
  ASSERT_TRUE(eventually([&] { return workers_of(server.id()).size() == 3; }));
  const std::map<pid_t, long> workers = workers_of(server.id());
  for (const auto& [process, ticks] : workers) {
    int sockets = 0;
    for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(process) + "/fd")) {
      std::error_code ec;
      sockets += has(fs::read_symlink(entry, ec).string(), "socket:") ? 1 : 0;
    }
    EXPECT_EQ(sockets, 1) << "the channel to the server, and no other";
  }
  server.signal(SIGKILL);
  server.wait();
  EXPECT_TRUE(eventually([&] {
    for (const auto& [process, ticks] : workers) {
      const ProcessTimes left = times_of("/proc/" + std::to_string(process));
      if (left.name == "fstop-worker" && left.state != 'Z') return false;
    }
    return true;
  }));
}

TEST(Workers, AReplacedSceneDoesNotChangeTheRenderThatIsUnderWay) {
  TestServer server(options_with(1, 0));
  const std::string expected = render(server, long_request(6)).body;
  TestServer other(options_with(1, 0));
  Client client(other.port());
  begin(client, long_request(6));
  ASSERT_GT(busiest(), 0);
  const fs::path file = other.folder().path() / "scenes/tiny/scene.json";
  std::string text = text_of_file(file);
  text.replace(text.find("0.2, 0.4, 0.6"), 13, "0.9, 0.1, 0.1");
  other.folder().write("scenes/tiny/scene.json", text);
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  ASSERT_EQ(answer->status, 200) << answer->body;
  EXPECT_TRUE(answer->body == expected);
  const Answer changed = render(other, long_request(6));
  EXPECT_NE(changed.header("fstop-render-id"), answer->header("fstop-render-id"));
  EXPECT_FALSE(changed.body == expected) << "the next render sees the new scene";
}

Scene scene_with_everything() {
  Scene scene;
  scene.title = "title";
  Image image(3, 2, 3);
  for (std::size_t i = 0; i < image.pixels().size(); ++i)
    image.pixels()[i] = static_cast<float>(i) / 7.0F;
  scene.textures.push_back({.name = "card", .file = "card.png", .image = image});
  scene.materials.push_back({.name = "m", .model = ShadingModel::phong, .ior = 1.5});
  MeshObject mesh{.file = "a.ply"};
  mesh.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.mesh.triangles = {{0, 1, 2}};
  scene.objects.push_back({.shape = mesh, .material = 0, .velocity = {1.0, 2.0, 3.0}});
  scene.objects.push_back({.shape = SphereObject{.radius = 0.1}});
  scene.lights.push_back({.kind = SpotLight{.exponent = 3.0}, .intensity = {1, 2, 3}});
  return scene;
}

std::string bytes_of(const server::MemoryFile& file) {
  std::string bytes;
  file.read([&](std::string_view view) { bytes = view; });
  return bytes;
}

TEST(WorkerMessages, ScenesComeOverWhole) {
  const Scene scene = scene_with_everything();
  const Scene read = server::scene_of(server::scene_file(scene));
  EXPECT_EQ(read.title, scene.title);
  EXPECT_EQ(read.textures.at(0).image, scene.textures[0].image);
  EXPECT_EQ(read.materials.at(0).ior, scene.materials[0].ior);
  const auto& mesh = std::get<MeshObject>(read.objects.at(0).shape).mesh;
  EXPECT_EQ(mesh.positions, std::get<MeshObject>(scene.objects[0].shape).mesh.positions);
  EXPECT_EQ(read.objects[0].velocity, scene.objects[0].velocity);
  EXPECT_EQ(std::get<SphereObject>(read.objects.at(1).shape).radius, 0.1);
  EXPECT_EQ(std::get<SpotLight>(read.lights.at(0).kind).exponent, 3.0);
}

// Whatever a broken worker sends, the server throws and goes on.
TEST(WorkerMessages, CutAndChangedBytesAreRefused) {
  server::WorkerResult result;
  result.photograph.color = Image(4, 3, 3);
  result.photograph.layers[Output::depth] = Image(4, 3, 1);
  result.photograph.report.method = "pinhole";
  result.photograph.report.warnings = {"one", "two"};
  const std::string whole = bytes_of(server::result_file(result));
  const auto file = [](std::string_view bytes) {
    std::string text(bytes);
    return server::MemoryFile::written([&](server::ByteWriter& writer) {
      for (const char c : text) writer(c);
    });
  };
  EXPECT_EQ(server::result_of(file(whole)).photograph.report.method, "pinhole");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_THROW(server::result_of(file(std::string_view(whole).substr(0, size))), Error) << size;
  EXPECT_THROW(server::result_of(file(whole + "x")), Error);
  int refused = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0x80);
    try {
      server::result_of(file(changed));  // a number, or a letter, may be any
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, 8) << "at least each byte of a length";
}

}  // namespace
}  // namespace fstop::test
