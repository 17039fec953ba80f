#include "api/scene_upload.h"

#include <cstdint>
#include <functional>
#include <zlib.h>

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "tests/references/zip_writer.h"

namespace fstop::api {
namespace {

using test::zip_of;
using test::ZipFile;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

const std::string kScene = R"({"format": "fstop-scene/1",
    "materials": {"m": {"model": "unlit", "emission": [1, 1, 1]}},
    "objects": [{"type": "mesh", "file": "parts/one.obj", "material": "m"}]})";
const std::string kMesh = "v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 1 2 3\n";

ErrorCode code_of(const std::string& archive) {
  try {
    read_upload("a", bytes_of(archive), Limits{});
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;  // none: no refusal has this code
}

TEST(SceneUpload, TakesScenesWithTheirFilesAndDropsTheRest) {
  const UploadedScene scene = read_upload(
      "a", bytes_of(zip_of({{"scene.json", kScene}, {"parts/one.obj", kMesh}, {"notes.txt", "x"}})),
      Limits{});
  ASSERT_EQ(scene.files.size(), 2U);
  EXPECT_EQ(scene.files[1].name, "parts/one.obj");
  EXPECT_NE(scene.reply.find("\"passed_over\":[\"notes.txt\"]"), std::string::npos) << scene.reply;
  EXPECT_EQ(ContractSchema("StoredScene").objection(nlohmann::json::parse(scene.reply)), "");
  const UploadedScene again = unpacked_upload(packed_upload(scene));
  EXPECT_EQ(again.reply, scene.reply);
  ASSERT_EQ(again.files.size(), 2U);
  EXPECT_EQ(again.files[1].bytes, scene.files[1].bytes);
}

TEST(SceneUpload, RefusesWhatArchivesMayNotHold) {
  const auto with = [](const ZipFile& file) {
    return zip_of({{"scene.json", kScene}, {"parts/one.obj", kMesh}, file});
  };
  EXPECT_EQ(code_of(with({"ok.txt", "x"})), ErrorCode::internal)
      << "the others differ in one thing";
  for (const char* name : {"../up.txt", "/etc/passwd", "a/../b", "a//b", ".hidden", "a/.git/x",
                           "back\\slash", "new\nline", "with blank", "\xc3\xa9", "./a", "a/./b"}) {
    EXPECT_EQ(code_of(with({name, "x"})), ErrorCode::bad_path) << name;
  }
  EXPECT_EQ(code_of(with({.name = "l", .content = "/etc/passwd", .mode = 0120777})),
            ErrorCode::unsupported)
      << "a link";
  EXPECT_EQ(code_of(with({.name = "d", .content = "", .mode = 0020666})), ErrorCode::unsupported);
  EXPECT_EQ(code_of(with({.name = "e", .content = "x", .flags = 1})), ErrorCode::unsupported);
  EXPECT_EQ(code_of(with({.name = "m", .content = "x", .method = 12})), ErrorCode::unsupported);
  EXPECT_EQ(code_of(with({"parts/one.obj", "again"})), ErrorCode::invalid_request);
  EXPECT_EQ(code_of(with({.name = "c", .content = "x", .checksum_error = 1})),
            ErrorCode::invalid_request);
  EXPECT_EQ(code_of(with({.name = "s", .content = "xx", .size_error = 1})),
            ErrorCode::invalid_request);
  EXPECT_EQ(code_of(with({.name = "n", .content = "x", .local_name = "o"})),
            ErrorCode::invalid_request);
  EXPECT_EQ(code_of(with({.name = "bomb", .content = std::string(20'000'000, 'a')})),
            ErrorCode::over_budget)
      << "20 MB of one letter";
  std::vector<ZipFile> many = {{"scene.json", kScene}};
  for (int i = 0; i < 1000; ++i) many.push_back({"f" + std::to_string(i), ""});
  EXPECT_EQ(code_of(zip_of(many)), ErrorCode::over_budget);
}

// Every cut and many single changes: refused or read, never worse (the sanitizers look on).
TEST(SceneUpload, DamagedArchivesAreRefused) {
  const std::string whole = zip_of({{"scene.json", kScene}, {"parts/one.obj", kMesh}});
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(code_of(whole.substr(0, length)), ErrorCode::internal) << length;
  std::uint32_t state = 1;
  for (int i = 0; i < 3000; ++i) {
    std::string changed = whole;
    state = state * 1664525U + 1013904223U;
    changed[(state >> 8U) % changed.size()] = static_cast<char>(state >> 24U);
    (void)code_of(changed);
  }
}

TEST(SceneUpload, ScenesMustBeWhole) {
  EXPECT_EQ(code_of(zip_of({{"parts/one.obj", kMesh}})), ErrorCode::invalid_request);
  EXPECT_EQ(code_of(zip_of({{"scene.json", kScene}})), ErrorCode::invalid_request);
  EXPECT_EQ(code_of(zip_of({{"scene.json", kScene}, {"parts/one.obj", "v 0 0"}})),
            ErrorCode::invalid_request);
  EXPECT_EQ(code_of(zip_of({{"scene.json", "{"}, {"parts/one.obj", kMesh}})),
            ErrorCode::malformed_json);
  EXPECT_EQ(code_of("plain text"), ErrorCode::unsupported);
  EXPECT_EQ(code_of(""), ErrorCode::unsupported);
}

TEST(SceneUpload, AGlbBecomesAScene) {
  const UploadedScene scene = read_upload("a", bytes_of(test::small_glb()), Limits{});
  ASSERT_EQ(scene.files.size(), 2U);
  const std::string text(reinterpret_cast<const char*>(scene.files[0].bytes.data()),
                         scene.files[0].bytes.size());
  const auto document = nlohmann::json::parse(text);
  EXPECT_EQ(ContractSchema("Scene").objection(document), "");
  EXPECT_EQ(document.at("materials").at("first").at("diffuse"),
            nlohmann::json::array({0.25, 0.5, 0.75}));
  ASSERT_EQ(document.at("lights").size(), 1U);
  EXPECT_EQ(document.at("lights")[0].at("position_m"), nlohmann::json::array({1.0, 2.0, 3.0}));
  const auto reply = nlohmann::json::parse(scene.reply);
  EXPECT_EQ(ContractSchema("StoredScene").objection(reply), "");
  ASSERT_EQ(reply.at("cameras").size(), 1U);
  const auto& camera = reply.at("cameras")[0];
  // A view of 2 atan(12/24) over 24 mm is that of 24 mm; the parent's 5 m along z add up.
  EXPECT_NEAR(camera.at("lens").at("focal_length_mm").get<double>(), 24.0, 1e-9);
  EXPECT_EQ(camera.at("position_m"), nlohmann::json::array({0.0, 0.0, 6.0}));
  EXPECT_FALSE(reply.at("not_mapped").empty());
}

TEST(SceneUpload, AnswersOfTheReaderAreNotTrusted) {
  for (const char* text : {"", "x", "5\n{}", "2\n{}1\n5\na", "2\n{}1\n4\n../a1\nx", "2\n{}0\n",
                           "99999999999999999999\n", "-1\n", "2\n{}0\nmore"}) {
    EXPECT_THROW(unpacked_upload(text), Error) << text;
  }
  EXPECT_EQ(problem_of_upload(to_json(http_problem(422, "bad-path", "no"))).status, 422);
  for (const char* text : {"", "{}", R"({"type": "/problems/x", "status": 200, "detail": ""})",
                           R"({"type": "/problems/x", "status": 500, "detail": ""})",
                           R"({"type": "x", "status": 422, "detail": ""})",
                           R"({"type": "/problems/x", "status": 422})"}) {
    EXPECT_THROW(problem_of_upload(text), Error) << text;
  }
}

}  // namespace
}  // namespace fstop::api
