// What a sweep keeps: its state, its files, and its patience.
#include "server/sweep_state.h"

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "api/render_id.h"
#include "core/error.h"
#include "server/content_folder.h"
#include "server/http_message.h"
#include "server/patient_store.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;
using server::CellFile;
using server::CellOutcome;
using server::ContentFolder;
using server::link_durably;
using server::SweepState;

CellOutcome outcome(std::uint32_t index, const std::string& report) {
  return {.index = index,
          .render_id = "render",
          .files = {{.name = "a.png", .sha256 = "aa", .bytes = 5'000'000'000},
                    {.name = "b.exr", .sha256 = "bb", .bytes = 1}},
          .report = report};
}

TEST(SweepState, RecordsOnceAndSurvives) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "state.db";
  {
    SweepState state(file);
    EXPECT_TRUE(state.recorded().empty());
    state.set_fact("sweep", "one");
    state.set_fact("sweep", "two");
    state.record(outcome(7, "first"));
    state.record(outcome(2, std::string("with a zero \0 inside", 20)));
    state.record(outcome(7, "second"));
    state.record({.index = 4, .problem = "{}"});
  }
  SweepState state(file);
  EXPECT_EQ(state.fact("sweep"), "two");
  EXPECT_EQ(state.fact("none"), std::nullopt);
  EXPECT_EQ(state.recorded(), (std::vector<std::uint32_t>{2, 4, 7}));
  EXPECT_EQ(state.failed(), 1U);
  ASSERT_TRUE(state.outcome(7));
  EXPECT_EQ(state.outcome(7)->report, "first") << "the first one stays";
  ASSERT_EQ(state.outcome(7)->files.size(), 2U);
  EXPECT_EQ(state.outcome(7)->files[0].bytes, 5'000'000'000U);
  EXPECT_EQ(state.outcome(7)->files[1].name, "b.exr");
  EXPECT_EQ(state.outcome(2)->report.size(), 20U);
  EXPECT_FALSE(state.outcome(3));
  state.forget(7);
  EXPECT_EQ(state.recorded(), (std::vector<std::uint32_t>{2, 4}));
  state.record(outcome(7, "third"));
  EXPECT_EQ(state.outcome(7)->report, "third");
}

TEST(SweepState, RefusesAFileOfAnotherKind) {
  const TemporaryFolder folder;
  folder.write("state.db", std::string(5000, 'x'));
  EXPECT_THROW(SweepState(folder.path() / "state.db"), Error);
  EXPECT_THROW(SweepState(folder.path() / "none/state.db"), Error);
}

TEST(ContentFolder, KeepsBytesByTheirHash) {
  const TemporaryFolder folder;
  folder.write("store/ab/left.part12-13", "half");
  ContentFolder store(folder.path() / "store");
  EXPECT_EQ(folder.files(), 0) << "what was half written is gone";
  const std::string hash = store.put("hello");
  EXPECT_EQ(hash, api::sha256_hex(std::string_view("hello")));
  EXPECT_EQ(store.put("hello"), hash);
  EXPECT_EQ(store.put(""), api::sha256_hex(std::string_view()));
  EXPECT_EQ(folder.files(), 2);
  EXPECT_EQ(store.get(hash), "hello");
  EXPECT_TRUE(store.has({.name = "", .sha256 = hash, .bytes = 5}));
  EXPECT_FALSE(store.has({.name = "", .sha256 = hash, .bytes = 6}));
  EXPECT_EQ(store.get(std::string(64, '0')), std::nullopt);
  link_durably(store.path_of(hash), folder.path() / "names/one/a.txt");
  link_durably(store.path_of(hash), folder.path() / "names/one/a.txt");
  EXPECT_EQ(text_of_file(folder.path() / "names/one/a.txt"), "hello");
  EXPECT_EQ(folder.files(), 3);
  folder.write("store/" + hash.substr(0, 2) + "/" + hash.substr(2), "hollo");
  EXPECT_EQ(store.get(hash), std::nullopt) << "damaged";
  EXPECT_FALSE(store.is_whole({.name = "", .sha256 = hash, .bytes = 5}));
  EXPECT_EQ(store.put("hello"), hash) << "written anew";
  EXPECT_TRUE(store.is_whole({.name = "", .sha256 = hash, .bytes = 5}));
}

// Has no room for the first `refusals` attempts.
class FullStore : public server::ContentStore {
 public:
  explicit FullStore(int refusals) : refusals_(refusals) {}
  std::string put(std::string_view bytes) override {
    if (refusals_-- > 0)
      throw server::Refusal(server::http::status::insufficient_storage, "storage-full", "full");
    return std::string(bytes);
  }
  std::optional<std::string> get(std::string_view) override { return std::nullopt; }

 private:
  int refusals_;
};

TEST(PatientStore, WaitsForRoomAndSaysSo) {
  FullStore full(2);
  std::vector<std::string> told;
  server::PatientStore patient(full, [&](std::string_view what) { told.emplace_back(what); }, {});
  EXPECT_EQ(patient.put("x"), "x");
  EXPECT_EQ(told, (std::vector<std::string>{"disk space", ""}));
  EXPECT_EQ(patient.put("y"), "y");
  EXPECT_EQ(told.size(), 2U);
}

TEST(PatientStore, StopsWhileItWaits) {
  FullStore full(1 << 20);
  std::stop_source stop;
  server::PatientStore patient(
      full, [&](std::string_view) { stop.request_stop(); }, stop.get_token());
  try {
    patient.put("x");
    FAIL() << "it cannot have been put";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace fstop::test
