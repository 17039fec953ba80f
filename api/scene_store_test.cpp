#include "api/scene_store.h"

#include <filesystem>
#include <fstream>
#include <unistd.h>

#include <gtest/gtest.h>

#include "api/contract_schema.h"
#include "api/problem.h"

namespace fstop::api {
namespace {

namespace fs = std::filesystem;

// One triangle, as OBJ and as the start of a PLY that promises more than it holds.
const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const std::string kTruncated =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n";

/// A folder of scenes of its own, removed at the end.
class SceneStoreTest : public testing::Test {
 protected:
  SceneStoreTest()
      : root_(fs::temp_directory_path() / ("fstop-scene-store-" + std::to_string(getpid()))) {
    fs::remove_all(root_);
    write("stored/bars/scene.json", scene("bars.obj", "Bars"));
    write("stored/bars/bars.obj", kTriangle);
  }
  ~SceneStoreTest() override { fs::remove_all(root_); }

  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name, std::ios::binary) << text;
  }

  static std::string scene(const std::string& mesh, const std::string& title) {
    return R"({"format": "fstop-scene/1", "title": ")" + title +
           R"(", "materials": {"m": {"model": "unlit"}},
               "objects": [{"type": "mesh", "file": ")" +
           mesh + R"(", "material": "m"}]})";
  }
  static RenderRequest request(const std::string& scene,
                               SceneNames names = SceneNames::stored_only) {
    return parse_render_request(R"({"scene": )" + scene + R"(, "camera": {"lens": {}}})", Limits{},
                                names);
  }
  SceneStore store() const {
    return {{root_ / "stored", root_ / "more", root_ / "absent"}, Limits{}};
  }

  FieldFault fault_of(const RenderRequest& asked) const {
    try {
      store().load(asked);
    } catch (const InvalidRequest& invalid) {
      EXPECT_EQ(problem(invalid).status, 422);
      return invalid.faults().at(0);
    }
    return {"", "accepted"};
  }

  fs::path root_;
};

TEST_F(SceneStoreTest, ListsScenesByName) {
  write("more/apple/scene.json", scene("a.obj", ""));
  write("more/bars/scene.json", scene("a.obj", "Hidden by the earlier folder"));
  write("more/broken/scene.json", "{");
  write("more/empty/readme.txt", "");
  write("more/Bad Name/scene.json", scene("a.obj", "Cannot be asked for"));
  const std::vector<SceneSummary> list = store().list();
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].name, "apple");
  EXPECT_EQ(list[0].title, "apple");
  EXPECT_EQ(list[1].title, "Bars");
  EXPECT_NE(list[2].description.find("Cannot be used"), std::string::npos);
  const auto json = nlohmann::json::parse(scene_list_json(list));
  EXPECT_EQ(ContractSchema("SceneList").objection(json), "");
}

TEST_F(SceneStoreTest, LoadsAStoredSceneWithItsAssets) {
  const LoadedScene loaded = store().load(request("\"bars\""));
  ASSERT_EQ(loaded.scene.objects.size(), 1U);
  EXPECT_EQ(std::get<MeshObject>(loaded.scene.objects[0].shape).mesh.triangles.size(), 1U);
  EXPECT_EQ(loaded.hash.size(), 64U);
  EXPECT_EQ(store().text("bars"), scene("bars.obj", "Bars"));
}

TEST_F(SceneStoreTest, HashesTextAndAssets) {
  const std::string hash = store().load(request("\"bars\"")).hash;
  write("stored/bars/scene.json", scene("bars.obj", "Another title"));
  EXPECT_EQ(store().load(request("\"bars\"")).hash, hash);
  write("stored/bars/bars.obj", "v 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(store().load(request("\"bars\"")).hash, hash);
}

// Another folder with these files holds the same scene.
TEST_F(SceneStoreTest, TellsAllFilesOfAScene) {
  write("stored/bars/notes.txt", "of no use to anybody");
  const std::vector<AssetBytes> files = store().files("bars");
  ASSERT_EQ(files.size(), 2U);
  for (const AssetBytes& file : files) {
    const auto* text = reinterpret_cast<const char*>(file.bytes.data());
    write("copy/bars/" + file.name, std::string(text, file.bytes.size()));
  }
  const SceneStore copy({root_ / "copy"}, Limits{});
  EXPECT_EQ(copy.load(request("\"bars\"")).hash, store().load(request("\"bars\"")).hash);
  EXPECT_THROW(store().files("none"), Error);
  Limits small;
  small.scene_file_bytes = files[0].bytes.size() + files[1].bytes.size() - 1;
  EXPECT_THROW(SceneStore({root_ / "stored"}, small).files("bars"), Error);
}

TEST_F(SceneStoreTest, RefusesStoredScenesThatAreAbsentOrBroken) {
  write("more/no-mesh/scene.json", scene("gone.obj", ""));
  write("more/cut/scene.json", scene("cut.ply", ""));
  write("more/cut/cut.ply", kTruncated);
  write("more/outside/scene.json", scene("../bars/bars.obj", ""));
  write("more/text/scene.json", "{\"format\": 1}");
  const struct {
    std::string name;
    std::string detail;
  } rows[] = {{"absent", "there is no"},
              {"no-mesh", "#/objects/0/file"},
              {"cut", "cut.ply"},
              {"outside", "#/objects/0/file"},
              {"text", "#/format"}};
  for (const auto& row : rows) {
    const FieldFault fault = fault_of(request("\"" + row.name + "\""));
    EXPECT_EQ(fault.pointer, "#/scene") << row.name;
    EXPECT_NE(fault.detail.find(row.detail), std::string::npos) << fault.detail;
    EXPECT_EQ(fault.detail.find(root_.string()), std::string::npos) << "a path of the server";
  }
  EXPECT_THROW(store().text("absent"), Error);
  EXPECT_THROW(store().text("../stored/bars"), Error);
}

TEST_F(SceneStoreTest, ResolvesFilesOfInlineScenesInStoredScenes) {
  write("stored/bars/cut.ply", kTruncated);
  EXPECT_EQ(fault_of(request(scene("bars/bars.obj", ""))).detail, "accepted");
  for (const std::string file :
       {"bars.obj", "bars/gone.obj", "gone/bars.obj", "bars/../bars/bars.obj",
        "../stored/bars/bars.obj", "/etc/passwd", "bars/cut.ply", "bars/"}) {
    EXPECT_EQ(fault_of(request(scene(file, ""))).pointer, "#/scene/objects/0/file") << file;
  }
}

TEST_F(SceneStoreTest, NamesEveryMemberThatNeedsABadFile) {
  const std::string inline_scene = R"({"format": "fstop-scene/1",
      "textures": {"card a": {"file": "bars/gone.png"}, "text": {"file": "bars/scene.json"}},
      "materials": {"m": {"model": "unlit"}},
      "objects": [{"type": "mesh", "file": "bars/gone.obj", "material": "m"},
                  {"type": "mesh", "file": "bars/bars.obj", "material": "m"},
                  {"type": "mesh", "file": "bars/gone.obj", "material": "m"}]})";
  try {
    store().load(request(inline_scene));
    FAIL();
  } catch (const InvalidRequest& invalid) {
    std::vector<std::string> pointers;
    for (const FieldFault& fault : invalid.faults()) pointers.push_back(fault.pointer);
    const std::vector<std::string> expected = {"#/scene/textures/card%20a/file",
                                               "#/scene/textures/text/file",
                                               "#/scene/objects/0/file", "#/scene/objects/2/file"};
    EXPECT_EQ(pointers, expected);
  }
}

TEST_F(SceneStoreTest, ReliefNeedsCoordinatesOfAMesh) {
  fs::copy_file(FSTOP_SOURCE_DIR "/core/scenes/night/label.png", root_ / "stored/bars/label.png");
  const auto scene_with = [](const std::string& mapping) {
    return R"({"format": "fstop-scene/1",
        "textures": {"t": {"file": "bars/label.png", "color_space": "linear"}},
        "materials": {"m": {"model": "phong", "normal_map": {"texture": "t"}}},
        "objects": [{"type": "sphere", "center_m": [0, 0, 0], "radius_m": 1, "material": "m"},
                    {"type": "mesh", "file": "bars/bars.obj", "material": "m")" +
           mapping + "}]}";
  };
  const FieldFault fault = fault_of(request(scene_with("")));
  EXPECT_EQ(fault.pointer, "#/scene/objects/1/mapping");
  EXPECT_NE(fault.detail.find("bars/bars.obj"), std::string::npos) << fault.detail;
  const std::string tube =
      R"(, "mapping": {"type": "cylindrical", "origin_m": [0, 0, 0], "height_m": 1})";
  EXPECT_EQ(fault_of(request(scene_with(tube))).detail, "accepted");
}

TEST_F(SceneStoreTest, LoadsFilesBesideARequest) {
  write("requests/scenes/slats.json", scene("slats.obj", ""));
  write("requests/scenes/slats.obj", kTriangle);
  write("requests/inline.obj", kTriangle);
  const auto load = [&](const std::string& scene) {
    return load_beside(request(scene, SceneNames::stored_or_files), root_ / "requests", store(),
                       Limits{});
  };
  EXPECT_EQ(load("\"scenes/slats.json\"").scene.objects.size(), 1U);
  EXPECT_EQ(load("\"bars\"").scene.objects.size(), 1U);
  EXPECT_EQ(load(scene("inline.obj", "")).scene.objects.size(), 1U);
  EXPECT_THROW(load("\"scenes/gone.json\""), InvalidRequest);
  EXPECT_THROW(load(scene("../stored/bars/bars.obj", "")), InvalidRequest);
  // One content, one hash, wherever the scene lies.
  write("requests/copy.json", scene("bars.obj", "Copy"));
  write("requests/bars.obj", kTriangle);
  EXPECT_EQ(load("\"copy.json\"").hash, load("\"bars\"").hash);
}

TEST_F(SceneStoreTest, BoundsWhatManyUsesOfOneFileTake) {
  Limits limits;
  limits.scene_triangles = 2;
  const SceneStore small({root_ / "stored"}, limits);
  std::string objects;
  for (int i = 0; i < 3; ++i) {
    objects += std::string(i == 0 ? "" : ",") +
               R"({"type": "mesh", "file": "bars/bars.obj", "material": "m"})";
  }
  const RenderRequest asked = request(R"({"format": "fstop-scene/1",
      "materials": {"m": {"model": "unlit"}}, "objects": [)" +
                                      objects + "]}");
  try {
    small.load(asked);
    FAIL();
  } catch (const InvalidRequest& invalid) {
    EXPECT_EQ(invalid.faults().at(0).pointer, "#/scene/objects/2/file");
  }
}

}  // namespace
}  // namespace fstop::api
