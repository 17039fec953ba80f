// What worker processes cost and keep: the latency of a preview in this process and in a worker,
// cancels until the worker is idle, and a small render beside many large ones. Arguments: cancels,
// previews, mice. All on the loopback, with the bundled still life.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

double load() {
  double average = 0.0;
  return getloadavg(&average, 1) == 1 ? average : -1.0;
}

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  return values.empty() ? 0.0
                        : values[static_cast<std::size_t>(q * double(values.size() - 1) + 0.5)];
}

// SplitMix64 (Steele, Lea & Flood 2014), in [0, 1).
double unit(std::uint64_t i) {
  std::uint64_t z = (i + 1) * 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1p-53;
}

void bring_still_life(TestServer& server) {
  const auto target = server.folder().path() / "scenes/still-life";
  std::filesystem::copy(std::string(FSTOP_SOURCE_DIR) + "/core/scenes/still-life", target,
                        std::filesystem::copy_options::recursive);
}

std::string request(int width, const std::string& quality, int seed) {
  return R"({"scene": "still-life", "camera": {"lens": {"f_number": 2.8, "focus_distance_m": 2}},
      "image": {"width": )" +
         std::to_string(width) + R"(, "height": )" + std::to_string(width * 2 / 3) +
         R"(}, "quality": )" + quality + R"(, "seed": )" + std::to_string(seed) + "}";
}

// Milliseconds from asking for a picture until it is there.
double asked(std::uint16_t port, const std::string& body) {
  Client client(port);  // on a busy machine an idle one might be closed meanwhile
  const auto start = Clock::now();
  client.send(request_text("POST", "/v1/renders", {}, body));
  const auto answer = client.read(false, 600s);
  if (!answer || answer->status != 200) std::printf("  (failed)\n");
  return Milliseconds(Clock::now() - start).count();
}

void measure_latency(int previews) {
  TestServer::Options here;
  here.simulate = [](const SimulationSpec& spec, const RayScene& scene, const RunControl& run) {
    return simulate(spec, scene, run);
  };
  TestServer before(here);
  TestServer after;
  bring_still_life(before);
  bring_still_life(after);
  const std::uint16_t one = before.port();
  const std::uint16_t other = after.port();
  const std::string quality = R"({"samples": 4, "max_error": 0.05})";
  for (int i = 0; i < 3; ++i) {
    asked(one, request(240, quality, i));
    asked(other, request(240, quality, i));
  }
  std::vector<double> in_process;
  std::vector<double> in_worker;
  std::vector<double> ratios;
  for (int i = 0; i < previews; ++i) {
    const std::string body = request(240, quality, 100 + i);
    const bool is_first = i % 2 == 0;
    const double a = asked(is_first ? one : other, body);
    const double b = asked(is_first ? other : one, body);
    in_process.push_back(is_first ? a : b);
    in_worker.push_back(is_first ? b : a);
    ratios.push_back(in_worker.back() / in_process.back());
  }
  std::printf(
      "preview, %d: in this process median %.1f ms, least %.1f; in a worker median %.1f ms, "
      "least %.1f; ratio of each pair, median %.3f; load %.1f\n",
      previews, quantile(in_process, 0.5), quantile(in_process, 0.0), quantile(in_worker, 0.5),
      quantile(in_worker, 0.0), quantile(ratios, 0.5), load());
}

// A scene of other bytes, so that it must be built anew.
void change_scene(TestServer& server, int number) {
  const std::string name = "scenes/still-life/scene.json";
  std::string text = text_of_file(server.folder().path() / name);
  const std::size_t open = text.find('[', text.find("\"background\":"));
  text.replace(open, text.find(']', open) + 1 - open,
               "[0.02, 0.02, " + std::to_string(0.02 + 1e-6 * number) + "]");
  server.folder().write(name, text);
}

void measure_cancels(int cancels) {
  TestServer::Options options;
  options.limits.concurrent_renders = 1;
  options.limits.express_renders = 0;
  TestServer server(options);
  bring_still_life(server);
  Client client(server.port());
  const auto counts = [&] { return server.server().render_counts(); };
  std::vector<double> all;
  std::vector<double> while_building;
  asked(server.port(), request(240, R"({"samples": 4})", 1));
  for (int i = 0; i < cancels; ++i) {
    const bool builds = i % 2 == 0;
    if (builds) change_scene(server, i);
    const auto builds_before = server.server().worker_counts().builds;
    client.send(request_text("POST", "/v1/renders", {{"Prefer", "respond-async"}},
                             request(960, R"({"samples": 2048})", 1000 + i)));
    const auto accepted = client.read();
    if (!accepted || accepted->status != 202) {
      std::printf("  (refused)\n");
      continue;
    }
    eventually([&] { return counts().running == 1; });
    std::this_thread::sleep_for(Milliseconds(600.0 * unit(static_cast<std::uint64_t>(i))));
    const auto start = Clock::now();
    client.send(request_text("DELETE", accepted->header("location")));
    while (counts().running > 0) std::this_thread::sleep_for(200us);
    const double took = Milliseconds(Clock::now() - start).count();
    client.read();
    all.push_back(took);
    if (builds && server.server().worker_counts().builds == builds_before)
      while_building.push_back(took);
  }
  std::printf(
      "cancel to idle worker, %zu: median %.1f ms, p99 %.1f, worst %.1f; the %zu of new "
      "scenes: median %.1f, p99 %.1f, worst %.1f; workers ended for it: %d; load %.1f\n",
      all.size(), quantile(all, 0.5), quantile(all, 0.99), quantile(all, 1.0),
      while_building.size(), quantile(while_building, 0.5), quantile(while_building, 0.99),
      quantile(while_building, 1.0), static_cast<int>(server.server().worker_counts().stopped),
      load());
}

void measure_mouse(int mice) {
  constexpr int kElephants = 200;
  TestServer::Options options;
  options.limits.queued_per_client = kElephants + 8;
  TestServer server(options);
  bring_still_life(server);
  const std::uint16_t mouse = server.port();
  const std::string small = R"({"samples": 4, "max_error": 0.05})";
  for (int i = 0; i < 3; ++i) asked(mouse, request(240, small, i));
  std::vector<double> solo;
  for (int i = 0; i < mice; ++i) solo.push_back(asked(mouse, request(240, small, 100 + i)));
  for (int i = 0; i < kElephants; ++i) {
    ask(server.port(), "POST", "/v1/renders", {{"Prefer", "respond-async"}},
        request(960, R"({"samples": 2048})", i));
  }
  eventually([&] { return server.server().render_counts().running == 2; });
  std::vector<double> beside;
  for (int i = 0; i < mice; ++i) beside.push_back(asked(mouse, request(240, small, 200 + i)));
  const double bound = 2.0 * quantile(solo, 0.5) + 1000.0;
  std::printf(
      "mouse alone: median %.1f ms; beside %d elephants: median %.1f, worst %.1f; bound, "
      "twice alone and 1 s: %.1f; load %.1f\n",
      quantile(solo, 0.5), server.server().render_counts().queued + 2, quantile(beside, 0.5),
      quantile(beside, 1.0), bound, load());
}

}  // namespace
}  // namespace fstop::test

int main(int argc, char** argv) {
  using namespace fstop::test;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const auto count = [&](int i, int usual) { return argc > i ? std::atoi(argv[i]) : usual; };
  if (count(2, 40) > 0) measure_latency(count(2, 40));
  if (count(1, 200) > 0) measure_cancels(count(1, 200));
  if (count(3, 20) > 0) measure_mouse(count(3, 20));
}
