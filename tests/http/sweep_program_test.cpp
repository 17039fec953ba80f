// fstop sweep and fstop dataset as people run them: files, manifests, kills, full disks, refusals.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"
#include "api/render_id.h"
#include "core/encode/image_codec.h"
#include "server/sweep_state.h"
#include "tests/http/dice.h"
#include "tests/http/program.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

// Beside `scenes`: 2 x `seeds` cells, whose layers have a file of their own.
std::string recipe(int seeds, int samples = 16, const std::string& members = {}) {
  return R"({"base": {"scene": "scenes/tiny/scene.json", "camera": {"lens": {"f_number": 2}},
      "image": {"width": 48, "height": 32}, "outputs": ["color", "depth", "valid"],
      "quality": {"samples": )" +
         std::to_string(samples) + R"(}}, "axes": [
      {"member": "/camera/lens/f_number", "values": [2, 8]},
      {"member": "/seed", "range": {"from": 1, "to": )" +
         std::to_string(seeds) + R"(, "step": 1}}])" + members + "}";
}

class SweepProgram : public testing::Test {
 protected:
  void SetUp() override { write_scenes(folder_); }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::vector<std::string> sweep_into(const std::string& out,
                                      const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments = {"sweep", path("recipe.json"), "--out", path(out)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  std::string manifest(const std::string& out) const {
    return text_of_file(folder_.path() / out / "manifest.json");
  }
  json summary_of(const Outcome& outcome) const { return json::parse(outcome.output); }
  // Every file of the manifest, by its hash.
  void expect_whole(const std::string& out) const {
    const json value = json::parse(manifest(out));
    EXPECT_EQ(api::ContractSchema("SweepManifest").objection(value), "");
    for (const json& file : value.at("files")) {
      const std::string bytes = text_of_file(folder_.path() / out / file.at("path"));
      EXPECT_EQ(bytes.size(), file.at("bytes")) << file;
      EXPECT_EQ(api::sha256_hex(bytes), file.at("sha256")) << file;
    }
  }
  // No file half written, whatever happened.
  void expect_no_leftovers(const std::string& out) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path() / out))
      EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
  }

  TemporaryFolder folder_;
};

TEST_F(SweepProgram, MakesEveryCellAsRenderDoes) {
  folder_.write("recipe.json", recipe(3));
  const Outcome outcome = run_fstop(sweep_into("out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
  const json summary = summary_of(outcome);
  EXPECT_EQ(summary.at("cells"), 6);
  EXPECT_EQ(summary.at("made"), 6);
  EXPECT_EQ(summary.at("failed"), 0);
  EXPECT_NE(outcome.errors.find("sweep: 100 %"), std::string::npos) << outcome.errors;
  expect_whole("out");
  const json told = json::parse(manifest("out"));
  ASSERT_EQ(told.at("files").size(), 12U);
  ASSERT_EQ(told.at("images").size(), 6U);
  EXPECT_EQ(told.at("scenes").size(), 1U);
  EXPECT_EQ(told.at("stacks").size(), 1U);
  for (const json& image : told.at("images")) {
    folder_.write("request.json", image.at("request").dump());
    const Outcome alone = run_fstop({"render", path("request.json"), "--out", path("alone.png")});
    ASSERT_EQ(alone.exit_code, 0) << alone.output;
    EXPECT_EQ(json::parse(alone.output).at("id"), image.at("render"));
    EXPECT_TRUE(text_of_file(folder_.path() / "alone.png") ==
                text_of_file(folder_.path() / "out" / image.at("file").get<std::string>()));
  }
  const std::string layers = text_of_file(folder_.path() / "out/cells/000000/layers.exr");
  EXPECT_NE(layers.find("mask.valid"), std::string::npos);
}

TEST_F(SweepProgram, RepeatsNothingAndMakesAnewWhatIsGone) {
  folder_.write("recipe.json", recipe(3));
  ASSERT_EQ(run_fstop(sweep_into("out")).exit_code, 0);
  const std::string before = manifest("out");
  const Outcome again = run_fstop(sweep_into("out", {"--resume"}));
  ASSERT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(summary_of(again).at("kept"), 6);
  EXPECT_EQ(summary_of(again).at("made"), 0);
  EXPECT_EQ(manifest("out"), before);
  const json file = json::parse(before).at("files")[3];
  const std::string hash = file.at("sha256");
  fs::remove(folder_.path() / "out/files" / hash.substr(0, 2) / hash.substr(2));
  fs::remove(folder_.path() / "out/manifest.json");
  const Outcome mended = run_fstop(sweep_into("out"));
  EXPECT_EQ(summary_of(mended).at("made"), 1) << mended.output;
  EXPECT_EQ(manifest("out"), before);
  expect_whole("out");
  // As many bytes, one of them another.
  const fs::path kept = folder_.path() / "out/files" / hash.substr(0, 2) / hash.substr(2);
  std::string bytes = text_of_file(kept);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  folder_.write("out/files/" + hash.substr(0, 2) + "/" + hash.substr(2), bytes);
  fs::remove(folder_.path() / "out/manifest.json");
  EXPECT_EQ(summary_of(run_fstop(sweep_into("out"))).at("made"), 1);
  EXPECT_EQ(manifest("out"), before);
  expect_whole("out");
  folder_.write("elsewhere/recipe.json", recipe(3));
  folder_.write("elsewhere/scenes/tiny/scene.json",
                text_of_file(folder_.path() / "scenes/tiny/scene.json"));
  ASSERT_EQ(
      run_fstop({"sweep", path("elsewhere/recipe.json"), "--out", path("other"), "--threads", "1"})
          .exit_code,
      0);
  EXPECT_EQ(manifest("other"), before) << "whatever the folder and the threads";
}

TEST_F(SweepProgram, KillsLoseAndRepeatNothing) {
  folder_.write("recipe.json", recipe(15, 512));
  const auto start = Clock::now();
  ASSERT_EQ(run_fstop(sweep_into("whole")).exit_code, 0);
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start);
  Dice dice(20261129);
  std::size_t recorded = 0;
  for (int kill = 0; kill < 5; ++kill) {
    {
      RunningProgram run(sweep_into("killed"));
      std::this_thread::sleep_for(took * dice.below(1000) / 1200);
      run.signal(SIGKILL);
      run.wait();
    }
    if (!fs::exists(folder_.path() / "killed/state.db")) continue;
    const std::size_t now =
        server::SweepState(folder_.path() / "killed/state.db").recorded().size();
    EXPECT_GE(now, recorded);
    recorded = now;
  }
  const Outcome last = run_fstop(sweep_into("killed"));
  ASSERT_EQ(last.exit_code, 0) << last.output << last.errors;
  EXPECT_EQ(summary_of(last).at("kept"), recorded);
  EXPECT_EQ(summary_of(last).at("made"), 30 - recorded);
  EXPECT_EQ(manifest("killed"), manifest("whole"));
  expect_whole("killed");
  expect_no_leftovers("killed");
}

TEST_F(SweepProgram, SignalsStopItBetweenCells) {
  folder_.write("recipe.json", recipe(20, 2048));
  const Outcome stopped = run_fstop_until(sweep_into("out"), "sweep: 10 %", SIGTERM);
  EXPECT_EQ(stopped.exit_code, 1);
  EXPECT_NE(stopped.output.find("the sweep was stopped: "), std::string::npos) << stopped.output;
  EXPECT_FALSE(fs::exists(folder_.path() / "out/manifest.json"));
  expect_no_leftovers("out");
}

TEST_F(SweepProgram, WaitsForDiskSpaceAndLosesNothing) {
  folder_.write("recipe.json", recipe(8));
  ASSERT_EQ(run_fstop(sweep_into("whole")).exit_code, 0);
  // Too little for the state, for some of it, for the layers.
  for (const std::uint64_t bytes : {4'096U, 20'000U, 50'000U, 90'000U}) {
    const std::string out = "full-" + std::to_string(bytes);
    RunningProgram run(sweep_into(out), bytes);
    ASSERT_TRUE(eventually([&] {
      return run.errors().find("sweep: waits for disk space") != std::string::npos;
    })) << run.errors();
    run.grant_space();
    const Outcome outcome = run.wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
    EXPECT_NE(outcome.errors.find("sweep: goes on"), std::string::npos) << outcome.errors;
    EXPECT_EQ(manifest(out), manifest("whole"));
    expect_whole(out);
    expect_no_leftovers(out);
  }
}

TEST_F(SweepProgram, StopsWhileItWaits) {
  folder_.write("recipe.json", recipe(8));
  RunningProgram run(sweep_into("out"), 20'000);
  ASSERT_TRUE(eventually([&] { return run.errors().find("waits") != std::string::npos; }));
  run.signal(SIGTERM);
  EXPECT_EQ(run.wait().exit_code, 1);
}

TEST_F(SweepProgram, CellsThatCannotBeMadeAreToldWithTheirProblem) {
  std::string text = recipe(2);
  text.replace(text.find("\"quality\": {"), 12,
               R"("effects": {"defocus": "on"}, "quality": {"method": "pinhole", )");
  text.replace(text.find("/camera/lens/f_number"), 21, "/effects/defocus");
  text.replace(text.find("[2, 8]"), 6, R"(["on", "off"])");
  folder_.write("recipe.json", text);
  const Outcome outcome = run_fstop(sweep_into("out"));
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_EQ(summary_of(outcome).at("failed"), 2);
  const json told = json::parse(manifest("out"));
  ASSERT_EQ(told.at("failures").size(), 2U);
  EXPECT_EQ(told.at("failures")[0].at("problem").at("type"), "/problems/no-valid-method");
  EXPECT_EQ(told.at("images").size(), 2U);
  expect_whole("out");
  EXPECT_EQ(summary_of(run_fstop(sweep_into("out"))).at("made"), 0) << "nor tried again";
}

TEST_F(SweepProgram, DryRunsTellTheCostAndMakeNothing) {
  folder_.write("recipe.json", recipe(3));
  const Outcome outcome = run_fstop({"sweep", path("recipe.json"), "--dry-run"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const json cost = json::parse(outcome.output);
  EXPECT_EQ(api::ContractSchema("SweepCost").objection(cost), "");
  EXPECT_EQ(cost.at("cells"), 6);
  EXPECT_EQ(cost.at("predicted").at("samples"), 6.0 * 48 * 32 * 16);
  EXPECT_GT(cost.at("predicted").at("cpu_s"), 0.0);
  folder_.write("recipe.json", recipe(3, 16, R"(, "dry_run": true)"));
  EXPECT_EQ(run_fstop(sweep_into("out")).output, outcome.output);
  EXPECT_FALSE(fs::exists(folder_.path() / "out"));
}

TEST_F(SweepProgram, RefusesWhatItCannotDo) {
  folder_.write("recipe.json", recipe(2));
  ASSERT_EQ(run_fstop(sweep_into("out")).exit_code, 0);
  const std::string before = manifest("out");
  struct Case {
    std::vector<std::string> arguments;
    std::string part;
  };
  folder_.write("bad.json", R"({"base": {"scene": "gone"}, "axes": [{"member": "/seed"}]})");
  folder_.write("gone.json", R"({"base": {"scene": "gone", "camera": {"lens": {}}}})");
  folder_.write("axis.json", R"({"base": {"camera": {"lens": {}}}, "axes": [
      {"member": "/scene", "values": ["scenes/tiny/scene.json", "scenes/gone.json"]}]})");
  folder_.write("mesh.json", R"({"base": {"scene": "scenes/broken-mesh/scene.json",
      "camera": {"lens": {}}}})");
  folder_.write("other.json", recipe(3));
  folder_.write("file", "");
  folder_.write("splice", R"({}, "axes": [])");
  for (const Case& wrong : std::initializer_list<Case>{
           {{"sweep", path("bad.json"), "--out", path("new")}, "#/axes/0"},
           {{"sweep", path("gone.json"), "--out", path("new")}, "#/base/scene"},
           {{"sweep", path("axis.json"), "--out", path("new")}, "#/axes/0"},
           {{"sweep", path("mesh.json"), "--out", path("new")}, "cut.ply"},
           {{"sweep", path("none.json"), "--out", path("new")}, "cannot open"},
           {{"sweep", path("recipe.json")}, "--out must name a folder"},
           {{"sweep", path("recipe.json"), "--out", path("new"), "--resume"}, "holds none"},
           {{"sweep", path("other.json"), "--out", path("out")}, "holds another sweep"},
           {{"dataset", "--out", path("new")}, "--count"},
           {{"dataset", "--count", "1", "--base", path("splice"), "--out", path("new")}, "JSON"},
           {{"dataset", "--count", "200000", "--out", path("new")}, "#/count"}}) {
    const Outcome outcome = run_fstop(wrong.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.output << outcome.errors;
    EXPECT_NE(outcome.output.find(wrong.part), std::string::npos) << outcome.output;
  }
  EXPECT_EQ(run_fstop({"sweep", path("recipe.json"), "--out", path("file")}).exit_code, 1);
  EXPECT_FALSE(fs::exists(folder_.path() / "new"));
  EXPECT_EQ(manifest("out"), before);
}

TEST_F(SweepProgram, OneProcessSweepsIntoAFolder) {
  folder_.write("recipe.json", recipe(20, 4096));
  RunningProgram run(sweep_into("out"));
  ASSERT_TRUE(eventually([&] { return run.errors().find("sweep: 0 %") != std::string::npos; }));
  const Outcome second = run_fstop(sweep_into("out"));
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.output.find("another process sweeps into"), std::string::npos) << second.output;
}

TEST_F(SweepProgram, DatasetsAreTheirSeed) {
  folder_.write("base.json",
                R"({"image": {"width": 48, "height": 32}, "quality": {"samples": 8}})");
  const auto made = [&](const std::string& seed, const std::string& out) {
    return run_fstop({"dataset", "--count", "4", "--images-per-scene", "2", "--seed", seed,
                      "--base", path("base.json"), "--out", path(out)});
  };
  const Outcome first = made("1", "first");
  ASSERT_EQ(first.exit_code, 0) << first.output << first.errors;
  ASSERT_EQ(made("1", "again").exit_code, 0);
  ASSERT_EQ(made("2", "other").exit_code, 0);
  EXPECT_EQ(manifest("first"), manifest("again"));
  EXPECT_NE(manifest("first"), manifest("other"));
  expect_whole("first");
  const json told = json::parse(manifest("first"));
  EXPECT_EQ(told.at("scenes").size(), 2U);
  EXPECT_EQ(told.at("stacks").size(), 2U);
  const std::string bytes = text_of_file(folder_.path() / "first/cells/000003/image.exr");
  const Picture picture = decode(std::as_bytes(std::span(bytes)));
  std::vector<std::string> channels;
  for (const ImageLayer& layer : picture.layers)
    channels.insert(channels.end(), layer.channel_names.begin(), layer.channel_names.end());
  for (const char* name :
       {"R", "Z", "dist.ray", "coc.signed", "coc.diameter", "mask.valid", "aif.G", "var.B"}) {
    EXPECT_EQ(std::ranges::count(channels, name), 1) << name;
  }
  const auto has = [&](const char* name) {
    return std::ranges::count(picture.attributes, name, &ImageAttribute::name) == 1;
  };
  for (const char* name : {"aperture", "focus", "expTime", "fstop:breathing", "fstop:seed"})
    EXPECT_TRUE(has(name)) << name;
}

TEST_F(SweepProgram, ThroughFocusIsSharpestWhereTheTargetIs) {
  folder_.write("recipe.json", R"({"recipe": "through-focus-mtf", "target_m": 2, "near_m": 1.2,
      "far_m": 6, "count": 5, "base": {"camera": {"lens": {"focal_length_mm": 50, "f_number": 2}},
      "image": {"width": 150, "height": 100}, "quality": {"samples": 64},
      "effects": {"diffraction": "off"}}})");
  const Outcome outcome = run_fstop(sweep_into("out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output << outcome.errors;
  expect_whole("out");
  std::vector<double> mtf50;
  const json told = json::parse(manifest("out"));
  for (const json& image : told.at("images")) {
    ASSERT_TRUE(image.at("edge").contains("mtf50_cycles_per_px")) << image.at("edge");
    mtf50.push_back(image.at("edge").at("mtf50_cycles_per_px"));
  }
  // In focus the pixel alone is left: sinc f = 1/2 at 0.603 cycles a pixel. Beside it a disc of c
  // px takes half away at f c = 0.705, with the pixel's own share earlier. Five equal steps in
  // dioptres, pixels of 0.24 mm: c is 0.9 px where the focus is a step off, 1.8 px at both ends.
  EXPECT_NEAR(mtf50[2], 0.603, 0.02);
  EXPECT_GT(mtf50[2], mtf50[1]);
  EXPECT_GT(mtf50[1], mtf50[0]);
  EXPECT_GT(mtf50[2], mtf50[3]);
  EXPECT_GT(mtf50[3], mtf50[4]);
}

}  // namespace
}  // namespace fstop::test
