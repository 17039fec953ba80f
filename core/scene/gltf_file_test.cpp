#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/scene/handmade_files.h"
#include "core/scene/scene_file.h"

namespace fstop {
namespace {

using handmade::Bytes;
using handmade::Writer;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr AssetLimits kLimits{.max_file_bytes = 1 << 24,
                              .max_triangles = 100,
                              .max_texture_pixels = 10'000,
                              .max_coordinate = 1e7};

// One triangle: positions at 0 (36 bytes), normals at 36 (36), uv bytes at 72 (6 and 6 of padding:
// a stride of 4), indices at 84 (6). Accessors 0 to 3 in that order.
const Bytes& triangle_data() {
  static const Bytes data = [] {
    Writer w;
    w.put_all<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    for (int i = 0; i < 3; ++i) w.put_all<float>({0, 0.6F, 0.8F});
    w.put_all<std::uint8_t>({0, 0, 0, 0, 255, 51, 0, 0, 0, 255, 0, 0});
    w.put_all<std::uint16_t>({0, 1, 2});
    return w.bytes();
  }();
  return data;
}

struct Parts {
  std::string nodes = R"([{"mesh": 0}])";
  std::string scenes = R"("scene": 0, "scenes": [{"nodes": [0]}],)";
  std::string primitive =
      R"({"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3})";
  std::string views =
      R"([{"buffer": 0, "byteLength": 72}, {"buffer": 0, "byteOffset": 72, "byteLength": 12, "byteStride": 4},
          {"buffer": 0, "byteOffset": 84, "byteLength": 6}])";
  std::string accessors =
      R"([{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
          {"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC3"},
          {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"},
          {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"}])";
  std::string buffers = R"([{"byteLength": 90}])";
  std::string more = "";  // members of the root
};

std::string json_of(const Parts& p) {
  return R"({"asset": {"version": "2.0"}, )" + p.more + p.scenes + R"("nodes": )" + p.nodes +
         R"(, "meshes": [{"primitives": [)" + p.primitive + R"(]}], "bufferViews": )" + p.views +
         R"(, "accessors": )" + p.accessors + R"(, "buffers": )" + p.buffers + "}";
}

Mesh load(const Parts& parts) {
  return decode_mesh("m.glb", handmade::glb(json_of(parts), triangle_data()), kLimits);
}

void expect_bad(const std::string& name, const Bytes& bytes, const std::string& part,
                const AssetLimits& limits = kLimits) {
  try {
    decode_mesh(name, bytes, limits);
    ADD_FAILURE() << "no error: " << part;
  } catch (const Error& error) {
    const std::string message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::bad_geometry) << message;
    EXPECT_TRUE(message.starts_with(name + ": ")) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message << "\nhas no: " << part;
  }
}

void expect_bad(const Parts& parts, const std::string& part) {
  expect_bad("m.glb", handmade::glb(json_of(parts), triangle_data()), part);
}

// Single precision numbers below 10, after some double operations: half a unit in the last place
// of the largest is 5e-7.
void expect_near(const std::array<float, 3>& found, const std::array<double, 3>& wanted) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(double{found[i]}, wanted[i], 5e-7);
}

TEST(GltfFile, ReadsATriangle) {
  const Mesh mesh = load({});
  EXPECT_EQ(mesh.positions, (std::vector<std::array<float, 3>>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
  ASSERT_EQ(mesh.normals.size(), 3U);
  expect_near(mesh.normals[1], {0, 0.6, 0.8});
  // c/255, and v counted from the bottom: 255 -> 1, 51 -> 0.2 -> 0.8.
  EXPECT_EQ(mesh.uvs, (std::vector<std::array<float, 2>>{{0, 1}, {1, 0.8F}, {0, 0}}));
}

TEST(GltfFile, ReadsDataUris) {
  Parts parts;
  parts.buffers = R"([{"byteLength": 90, "uri": "data:application/octet-stream;base64,)" +
                  handmade::base64(triangle_data()) + R"("}])";
  const Mesh mesh = decode_mesh("m.gltf", handmade::bytes_of(json_of(parts)), kLimits);
  const Mesh binary = load({});
  EXPECT_EQ(mesh.positions, binary.positions);
  EXPECT_EQ(mesh.normals, binary.normals);
  EXPECT_EQ(mesh.uvs, binary.uvs);
  EXPECT_EQ(mesh.triangles, binary.triangles);
}

TEST(GltfFile, ReadsUnindexedTrianglesAndJoinsPrimitives) {
  Parts parts;
  parts.primitive = R"({"attributes": {"POSITION": 0}}, {"mode": 1, "attributes": {"POSITION": 0}},
                       {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 3, "mode": 4})";
  const Mesh mesh = load(parts);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(mesh.positions.size(), 6U);
  EXPECT_TRUE(mesh.normals.empty());  // of the first primitive
}

// (1,0,0) is scaled by 2 to (2,0,0), turned by 90 degrees about z to (0,2,0) and moved.
TEST(GltfFile, AppliesScaleThenRotationThenTranslation) {
  Parts parts;
  parts.nodes = R"([{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2],
                     "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752]}])";
  const Mesh mesh = load(parts);
  expect_near(mesh.positions[0], {1, 2, 3});
  expect_near(mesh.positions[1], {1, 4, 3});
  expect_near(mesh.positions[2], {-1, 2, 3});
  expect_near(mesh.normals[0], {-0.6, 0, 0.8});
}

// The child's matrix (column-major) turns x to y, y to z, z to x and moves by 1 along x; the
// parent moves by 10 along y. The uv of the two copies of the mesh are the same.
TEST(GltfFile, MultipliesMatricesDownTheTree) {
  Parts parts;
  parts.nodes = R"([{"children": [1, 2], "translation": [0, 10, 0]},
                    {"mesh": 0, "matrix": [0,1,0,0, 0,0,1,0, 1,0,0,0, 1,0,0,1]}, {"mesh": 0}])";
  const Mesh mesh = load(parts);
  ASSERT_EQ(mesh.positions.size(), 6U);
  // Depth first, the last child before the first.
  expect_near(mesh.positions[1], {1, 10, 0});
  expect_near(mesh.positions[3], {1, 10, 0});
  expect_near(mesh.positions[4], {1, 11, 0});
  expect_near(mesh.positions[5], {1, 10, 1});
  expect_near(mesh.normals[3], {0.8, 0, 0.6});
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {3, 4, 5}}));
}

// The inverse transpose of diag(1,1,2) takes (0, 0.6, 0.8) to (0, 0.6, 0.4), of length
// sqrt(0.52). Mirrored at x = 0 the winding turns, and the normal keeps its y and z.
TEST(GltfFile, TransformsNormalsAndWinding) {
  Parts parts;
  parts.nodes = R"([{"mesh": 0, "scale": [1, 1, 2]}])";
  expect_near(load(parts).normals[0], {0, 0.6 / std::sqrt(0.52), 0.4 / std::sqrt(0.52)});
  parts.nodes = R"([{"mesh": 0, "scale": [-1, 1, 1]}])";
  const Mesh mirrored = load(parts);
  EXPECT_EQ(mirrored.triangles, (Triangles{{0, 2, 1}}));
  expect_near(mirrored.positions[1], {-1, 0, 0});
  expect_near(mirrored.normals[0], {0, 0.6, 0.8});
}

TEST(GltfFile, WithoutScenesTakesEveryRoot) {
  Parts parts;
  parts.scenes = "";
  parts.nodes = R"([{"children": [1]}, {"mesh": 0}, {"mesh": 0}])";
  EXPECT_EQ(load(parts).triangles.size(), 2U);
  parts.scenes = R"("scenes": [{"nodes": [2]}],)";
  EXPECT_EQ(load(parts).triangles.size(), 1U);
}

TEST(GltfFile, PassesOverPicturesAndMaterials) {
  Parts parts;
  parts.more =
      R"("extensionsRequired": ["KHR_materials_unlit"], "materials": [{"name": "\u00e9"}],
         "images": [{"uri": "missing.png"}, {"bufferView": 2, "mimeType": "image/png"},
                    {"uri": "data:image/png;base64,AAAA"}], "textures": [{"source": 0}],)";
  EXPECT_NO_THROW(load(parts));
}

TEST(GltfFile, NeverReadsAnotherFile) {
  const auto folder =
      std::filesystem::temp_directory_path() /
      ("fstop-gltf-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
       std::to_string(std::chrono::steady_clock::now().time_since_epoch().count()));
  std::filesystem::create_directory(folder);
  const std::string file = (folder / "data.bin").string();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(triangle_data().data()), 90);
  Parts parts;
  for (const std::string& uri : {file, "file://" + file, std::string("data.bin"), std::string()}) {
    parts.buffers = R"([{"byteLength": 90, "uri": ")" + uri + R"("}])";
    expect_bad("m.gltf", handmade::bytes_of(json_of(parts)), "embedded buffers");
  }
  std::filesystem::remove_all(folder);
}

TEST(GltfFile, RefusesWhatItWouldGetWrong) {
  using Change = std::function<void(Parts&)>;
  const std::vector<std::pair<std::string, Change>> cases = {
      {"skinned", [](Parts& p) { p.nodes = R"([{"mesh": 0, "skin": 0}])"; }},
      {"strips", [](Parts& p) { p.primitive = R"({"attributes": {"POSITION": 0}, "mode": 5})"; }},
      {"sparse",
       [](Parts& p) {
         p.accessors.replace(p.accessors.find(R"("count")"), 0,
                             R"("sparse": {"count": 1, "indices": {"bufferView": 2,
                                "componentType": 5123}, "values": {"bufferView": 0}},)");
       }},
      {"extension",
       [](Parts& p) { p.more = R"("extensionsRequired": ["KHR_draco_mesh_compression"],)"; }},
      {"two parents", [](Parts& p) { p.nodes = R"([{"children": [1]}, {"children": [0]}])"; }},
      {"two parents", [](Parts& p) { p.nodes = R"([{"children": [1, 1]}, {"mesh": 0}])"; }},
      {"asks for node 7", [](Parts& p) { p.nodes = R"([{"children": [7]}])"; }},
      {"asks for mesh 1 of 1", [](Parts& p) { p.nodes = R"([{"mesh": 1}])"; }},
      {"asks for scene 3", [](Parts& p) { p.scenes = R"("scene": 3, "scenes": [{}],)"; }},
      {"asks for accessor -1", [](Parts& p) { p.primitive = R"({"attributes": {"NORMAL": 1}})"; }},
      {"asks for accessor 9", [](Parts& p) { p.primitive = R"({"attributes": {"POSITION": 9}})"; }},
      {"wrong type", [](Parts& p) { p.primitive = R"({"attributes": {"POSITION": 3}})"; }},
      {"no triangle", [](Parts& p) { p.nodes = "[{}]"; }},
      {"no triangle", [](Parts& p) { p.nodes = R"([{"mesh": 0, "scale": [0, 0, 0]}])"; }},
      {"rotation has length 0",
       [](Parts& p) { p.nodes = R"([{"mesh": 0, "rotation": [0, 0, 0, 0]}])"; }},
      {"transform has the wrong length",
       [](Parts& p) { p.nodes = R"([{"mesh": 0, "scale": [1, 1]}])"; }},
      {"not finite or lies",
       [](Parts& p) { p.nodes = R"([{"mesh": 0, "scale": [1e308, 1e308, 1]}])"; }}};
  for (const auto& [part, change] : cases) {
    Parts parts;
    change(parts);
    expect_bad(parts, part);
  }
}

TEST(GltfFile, RefusesAccessorsBeyondTheirBuffer) {
  const auto with = [](const std::string& from, const std::string& to, std::string Parts::*member) {
    Parts parts;
    const std::size_t at = (parts.*member).find(from);
    EXPECT_NE(at, std::string::npos) << from;
    (parts.*member).replace(at, from.size(), to);
    return parts;
  };
  const std::string beyond = "reaches beyond its buffer";
  expect_bad(with(R"("byteOffset": 36)", R"("byteOffset": 40)", &Parts::accessors), beyond);
  expect_bad(with(R"("byteOffset": 36)", R"("byteOffset": 64)", &Parts::accessors), beyond);
  expect_bad(
      with(R"("byteOffset": 36)", R"("byteOffset": 18446744073709551580)", &Parts::accessors),
      beyond);
  expect_bad(with(R"("byteLength": 72)", R"("byteLength": 91)", &Parts::views), beyond);
  expect_bad(with(R"("byteOffset": 84)", R"("byteOffset": 18446744073709551612)", &Parts::views),
             beyond);
  expect_bad(with(R"("byteOffset": 36)", R"("byteOffset" : -4)", &Parts::accessors), "negative");
  expect_bad(with(R"("byteOffset": 84)", R"("byteOffset": -84)", &Parts::views), "negative");
  expect_bad(with(R"("count": 3)", R"("count": 7)", &Parts::accessors), beyond);
  expect_bad(with(R"("count": 3)", R"("count": 0)", &Parts::accessors), "holds none");
  expect_bad(with(R"("count": 3)", R"("count": 4611686018427387905)", &Parts::accessors),
             "or more than");
  expect_bad(with(R"("count": 3)", R"("count": 2)", &Parts::accessors),
             "asks for a vertex beyond 2");
  // Two corners of three, and normals for two vertices of three.
  expect_bad(
      with(R"("count": 3, "type": "SCALAR")", R"("count": 2, "type": "SCALAR")", &Parts::accessors),
      "fewer than three corners");
  expect_bad(with(R"("byteOffset": 36, "componentType": 5126, "count": 3)",
                  R"("byteOffset": 36, "componentType": 5126, "count": 2)", &Parts::accessors),
             "one item for each vertex");
}

// What would cost the library memory or stack is refused from the text alone.
TEST(GltfFile, BoundsItsJson) {
  Parts parts;
  parts.more = R"("extras": )" + std::string(100'000, '[') + std::string(100'000, ']') + ',';
  expect_bad(parts, "nested too deeply");
  const auto nested = [](std::size_t levels) {  // below the root, which is one more
    return R"("extras": )" + std::string(levels, '[') + std::string(levels, ']') + ',';
  };
  parts.more = nested(63);
  EXPECT_NO_THROW(load(parts));
  parts.more = nested(64);
  expect_bad(parts, "nested too deeply");
  parts.more = R"("materials": [{})";
  for (int i = 0; i < 200'000; ++i) parts.more += ",{}";
  parts.more += "],";
  expect_bad(parts, "more than 200000 values");
  parts.more = "";
  parts.buffers = R"([{"byteLength": 90}, {"byteLength": 90}])";
  expect_bad(parts, "more than one buffer");
  parts.buffers = R"([{"byteLength": 90}])";
  parts.more = R"("b\u0075ffers": [{"byteLength": 90}, {"byteLength": 90}],)";
  expect_bad(parts, "more than one buffer");
}

TEST(GltfFile, RefusesBrokenFiles) {
  const Bytes whole = handmade::glb(json_of({}), triangle_data());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    expect_bad("m.glb", {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}, "");
  }
  for (const char* json :
       {"", "{", "[]", "null", "{}", R"({"asset": {"version": 2}})",
        R"({"asset": {"version": "1.0"}})", R"({"asset": {"version": "2.0"}, "nodes": 3})"}) {
    expect_bad("m.gltf", handmade::bytes_of(json), "");
  }
}

TEST(GltfFile, KeepsToTheLimits) {
  const Bytes file = handmade::glb(json_of({}), triangle_data());
  AssetLimits limits = kLimits;
  limits.max_triangles = 1;
  EXPECT_NO_THROW(decode_mesh("m.glb", file, limits));
  Parts twice;
  twice.nodes = R"([{"mesh": 0, "children": [1]}, {"mesh": 0}])";
  expect_bad("m.glb", handmade::glb(json_of(twice), triangle_data()), "more than 3 vertices",
             limits);
  limits = kLimits;
  limits.max_coordinate = 0.5;
  expect_bad("m.glb", file, "vertex 1 is not finite or lies beyond", limits);
}

}  // namespace
}  // namespace fstop
