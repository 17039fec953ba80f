#include "api/cell_json.h"

#include <gtest/gtest.h>

#include "api/problem.h"

namespace fstop::api {
namespace {

const std::string kHash(64, 'a');

CellRecord record() {
  return {.index = 7,
          .render_id = std::string(64, 'b'),
          .files = {{"image.png", kHash, 123}, {"layers.exr", std::string(64, '0'), 1ULL << 40}},
          .report = R"({"b":1,"a":"\u0000 \"quoted\""})",
          .problem = {}};
}

// The pointers of what is wrong with a text.
template <typename Parse>
std::string fault_of(const Parse& parse, const std::string& text) {
  try {
    parse(text, Limits{});
  } catch (const InvalidRequest& invalid) {
    return invalid.faults().front().pointer;
  }
  return "none";
}

TEST(CellJson, OrdersComeBackByteByByte) {
  const CellOrder order{.engine = "fstop/1",
                        .scene = std::string(64, 'c'),
                        .sweep = kHash,
                        .index = 4'294'967'295U,
                        .request = "{ \"seed\" : 1 }\n"};
  const CellOrder back = parse_cell_order(to_json(order), Limits{});
  EXPECT_EQ(back.engine, order.engine);
  EXPECT_EQ(back.scene, order.scene);
  EXPECT_EQ(back.sweep, order.sweep);
  EXPECT_EQ(back.index, order.index);
  EXPECT_EQ(back.request, order.request);
  EXPECT_EQ(back.stored_request, "");
  const CellOrder large{.engine = "fstop/1", .sweep = kHash, .index = 0, .stored_request = kHash};
  EXPECT_EQ(parse_cell_order(to_json(large), Limits{}).stored_request, kHash);
  EXPECT_EQ(parse_cell_order(to_json(large), Limits{}).part, "") << "of the whole cell";
  CellOrder part = order;
  part.part = std::string(64, 'd');
  EXPECT_EQ(parse_cell_order(to_json(part), Limits{}).part, part.part);
}

TEST(CellJson, OrdersNameTheFilesOfTheirScenes) {
  const auto order = [](const std::string& name) {
    return CellOrder{.engine = "fstop/1",
                     .scene = kHash,
                     .scene_files = {{name, kHash, 5}},
                     .sweep = kHash,
                     .index = 0,
                     .request = "{}"};
  };
  for (const char* name : {"scene.json", "textures/wall.png", "a/b/c_d-e.obj"}) {
    const CellOrder back = parse_cell_order(to_json(order(name)), Limits{});
    ASSERT_EQ(back.scene_files.size(), 1U);
    EXPECT_EQ(back.scene_files[0].name, name);
    EXPECT_EQ(back.scene_files[0].sha256, kHash);
    EXPECT_EQ(back.scene_files[0].bytes, 5U);
  }
  for (const char* name : {"", "/etc/passwd", "../up", "a/../b", "a//b", "a/", "a/.b"}) {
    EXPECT_EQ(fault_of(parse_cell_order, to_json(order(name))), "#/scene_files/0/name") << name;
  }
}

TEST(CellJson, RecordsComeBackByteByByte) {
  const CellRecord made = record();
  const CellRecord back = parse_cell_record(to_json(made), Limits{});
  EXPECT_EQ(back.index, 7U);
  EXPECT_EQ(back.render_id, made.render_id);
  EXPECT_EQ(back.report, made.report);
  ASSERT_EQ(back.files.size(), 2U);
  EXPECT_EQ(back.files[1].name, "layers.exr");
  EXPECT_EQ(back.files[1].sha256, std::string(64, '0'));
  EXPECT_EQ(back.files[1].bytes, 1ULL << 40);
  EXPECT_EQ(to_json(back), to_json(made));
  const CellRecord refused{.index = 1, .problem = R"({"type":"/problems/x","status":422})"};
  EXPECT_EQ(parse_cell_record(to_json(refused), Limits{}).problem, refused.problem);
}

TEST(CellJson, ForeignOrdersAreRefusedWhereTheyAreWrong) {
  for (const auto& [text, pointer] : std::vector<std::pair<std::string, std::string>>{
           {"", "#"},
           {"[]", "#"},
           {R"({"engine":"e","sweep":"s","index":1})", "#"},
           {R"({"sweep":"s","index":1,"request":"{}"})", "#/engine"},
           {R"({"engine":"e","scene":"x","sweep":"s","index":1,"request":"{}"})", "#/scene"},
           {R"({"engine":"e","sweep":"s","index":-1,"request":"{}"})", "#/index"},
           {R"({"engine":"e","sweep":"s","index":4294967296,"request":"{}"})", "#/index"},
           {R"({"engine":"e","sweep":"s","index":1,"request":{}})", "#/request"},
           {R"({"engine":"e","sweep":"s","index":1,"request":"{}","stored_request":")" + kHash +
                "\"}",
            "#"},
           {R"({"engine":"e","sweep":"s","index":1,"stored_request":"../../etc"})",
            "#/stored_request"},
           {R"({"engine":"e","sweep":"s","index":1,"request":"{}","part":"x"})", "#/part"},
           {R"({"engine":"e","sweep":"s","index":1,"request":"{}","more":1})", "#/more"}})
    EXPECT_EQ(fault_of(parse_cell_order, text), pointer) << text;
}

TEST(CellJson, ForeignRecordsAreRefusedWhereTheyAreWrong) {
  const auto with_file = [](const std::string& file) {
    return R"({"index":1,"files":[)" + file + "]}";
  };
  const std::string good = R"({"name":"image.png","sha256":")" + kHash + R"(","bytes":1})";
  EXPECT_EQ(fault_of(parse_cell_record, with_file(good)), "none");
  for (const char* name : {"", ".", "..", ".hidden", "a/b", "a\\\\b", "a b"}) {
    const std::string file =
        R"({"name":")" + std::string(name) + R"(","sha256":")" + kHash + R"(","bytes":1})";
    EXPECT_EQ(fault_of(parse_cell_record, with_file(file)), "#/files/0/name") << name;
  }
  EXPECT_EQ(fault_of(parse_cell_record, with_file(R"({"name":"a","sha256":"AA","bytes":1})")),
            "#/files/0/sha256");
  EXPECT_EQ(fault_of(parse_cell_record,
                     with_file(R"({"name":"a","sha256":")" + kHash + R"(","bytes":-1})")),
            "#/files/0/bytes");
  EXPECT_EQ(fault_of(parse_cell_record, R"({"index":1,"files":[)" + good + R"(],"problem":"{}"})"),
            "#");
}

TEST(CellJson, AStoredTextNamesItsHashAndNothingElseDoes) {
  EXPECT_EQ(stored_text_hash(stored_text(kHash)), kHash);
  EXPECT_EQ(stored_text_hash(R"({"index":1})"), "");
  EXPECT_EQ(stored_text_hash(stored_text(std::string(64, 'A'))), "");
  EXPECT_EQ(stored_text_hash(stored_text(std::string(63, 'a'))), "");
}

}  // namespace
}  // namespace fstop::api
