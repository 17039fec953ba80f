#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/scene/handmade_files.h"
#include "core/scene/scene_file.h"

namespace fstop {
namespace {

using handmade::bytes_of;
using handmade::Writer;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;
using Vectors = std::vector<std::array<float, 3>>;
using Pairs = std::vector<std::array<float, 2>>;

constexpr AssetLimits kLimits{.max_file_bytes = 1 << 20,
                              .max_triangles = 100,
                              .max_texture_pixels = 10'000,
                              .max_coordinate = 1e7};

Mesh obj(const std::string& text, const AssetLimits& limits = kLimits) {
  return decode_mesh("m.obj", bytes_of(text), limits);
}
Mesh ply(const std::vector<std::byte>& bytes, const AssetLimits& limits = kLimits) {
  return decode_mesh("m.ply", bytes, limits);
}

// The message must name the file and hold `part`.
void expect_bad(const std::string& name, const std::vector<std::byte>& bytes,
                const std::string& part, const AssetLimits& limits = kLimits) {
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

TEST(ObjFile, SplitsPolygonsIntoFans) {
  const Mesh mesh = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.5 2 0\nv 0 1 -0.25\nf 1 2 3 4 5\n");
  EXPECT_EQ(mesh.positions,
            (Vectors{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5F, 2, 0}, {0, 1, -0.25F}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.uvs.empty());
}

TEST(ObjFile, ReadsEveryFormOfIndex) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n";
  const Vectors positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const Vectors normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  const Pairs uvs = {{0, 0}, {1, 0}, {0, 1}};
  const Triangles triangles = {{0, 1, 2}};
  struct Form {
    const char* face;
    bool with_uvs;
    bool with_normals;
  };
  for (const Form& form :
       {Form{"f 1 2 3", false, false}, Form{"f 1/1 2/2 3/3", true, false},
        Form{"f 1//1 2//1 3//1", false, true}, Form{"f 1/1/1 2/2/1 3/3/1", true, true},
        Form{"f -3 -2 -1", false, false}, Form{"f -3/-3/-1 -2/-2/-1 -1/-1/-1", true, true}}) {
    const Mesh mesh = obj(vertices + form.face);
    EXPECT_EQ(mesh.positions, positions) << form.face;
    EXPECT_EQ(mesh.triangles, triangles) << form.face;
    EXPECT_EQ(mesh.normals, form.with_normals ? normals : Vectors{}) << form.face;
    EXPECT_EQ(mesh.uvs, form.with_uvs ? uvs : Pairs{}) << form.face;
  }
}

// Two triangles share the positions 2 and 3. Vertex 2/1 is used twice and made once; position 3
// has two texture coordinates and is made twice: five corners.
TEST(ObjFile, MakesAVertexOnceForEachTriple) {
  const Mesh mesh =
      obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 0.5 0.75\n"
          "f 1/1 2/1 3/1\nf 2/1 4/1 3/2\n");
  EXPECT_EQ(mesh.positions, (Vectors{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.uvs, (Pairs{{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0.5F, 0.75F}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {1, 3, 4}}));
}

TEST(ObjFile, TakesNormalsOnlyIfEveryVertexHasOne) {
  const Mesh mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 1\nf 1/1/1 2/1 3/1/1\n");
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_EQ(mesh.uvs, (Pairs{{1, 0}, {1, 0}, {1, 0}}));  // v is 0 where it is left out
}

TEST(ObjFile, MakesNormalsUnitVectors) {
  const Mesh mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 3 0 4\nvn 0 0 1e-30\nf 1//1 2//2 3//2\n");
  EXPECT_EQ(mesh.normals, (Vectors{{0.6F, 0, 0.8F}, {0, 0, 1}, {0, 0, 1}}));
}

TEST(ObjFile, ReadsWhatPeopleWrite) {
  const Mesh mesh =
      obj("# comment\r\nmtllib x.mtl\r\no thing\r\n\r\n\tv +1e0 0 0 1.0 # with a weight\r\n"
          "v 0 .5 0 0.1 0.2 0.3\r\nv 0 0 \\\r\n 2.\r\nusemtl a\r\ns off\r\nl 1 2\r\n"
          "f 1 2 \\\n 3   # the end\r\n");
  EXPECT_EQ(mesh.positions, (Vectors{{1, 0, 0}, {0, 0.5F, 0}, {0, 0, 2}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
}

TEST(ObjFile, DropsTrianglesWithoutArea) {
  const Mesh mesh = obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 4\nf 1 2 4\n");
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 3}}));
}

TEST(ObjFile, RefusesBrokenFiles) {
  const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no triangle"},
      {v, "no triangle"},
      {"not a mesh at all", "no triangle"},
      {v + "f 1 2", "line 4: a face has fewer"},
      {v + "f", "line 4: a face has fewer"},
      {v + "f 1 2 4", "vertex 4 of 3"},
      {v + "f 1 2 0", "line 4: an index is out of range"},
      {v + "f 1 2 -4", "line 4: an index is out of range"},
      {v + "f 1 2 99999999999", "line 4: an index is out of range"},
      {v + "f 1 2 99999999999999999999", "line 4: an index is missing or malformed"},
      {v + "f 1 2 3x", "line 4: an index is missing or malformed"},
      {v + "f 1/ 2 3", "line 4: an index is missing or malformed"},
      {v + "f 1/1 2/1 3/1", "texture coordinate 1 of 0"},
      {v + "f 1//2 2//2 3//2", "normal 2 of 0"},
      {"v 0 0\n", "line 1: a number is missing"},
      {"v 0 0 x\n", "line 1: a number is missing"},
      {"v 0 0 1e999\n", "line 1: a number is missing"},
      {"v 0 0 nan\n", "line 1: a number is not finite"},
      {"v 0 inf 0\n", "line 1: a number is not finite"},
      {"v 0 -1.1e7 0\n", "line 1: vertex 1 lies beyond"},
      {v + "vt 1e60 0\nf 1/1 2/1 3/1", "texture coordinates of vertex 0"},
      {v + "vn 0 0 0\nf 1//1 2//1 3//1", "vertex 0 has length 0"},
      {v + "f 1 1 2", "no triangle"}};
  for (const auto& [text, part] : cases) expect_bad("m.obj", bytes_of(text), part);
}

TEST(ObjFile, KeepsToTheLimits) {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  AssetLimits limits = kLimits;
  limits.max_triangles = 2;
  EXPECT_EQ(obj(square, limits).triangles.size(), 2U);
  limits.max_triangles = 1;
  expect_bad("m.obj", bytes_of(square), "line 5: more than 1 triangles", limits);
  limits = kLimits;
  limits.max_coordinate = 1.0;
  EXPECT_NO_THROW(obj(square, limits));
  limits.max_file_bytes = square.size() - 1;
  expect_bad("m.obj", bytes_of(square), "bytes", limits);
}

TEST(MeshFile, RefusesOtherExtensions) {
  for (const char* name : {"m.stl", "obj", "m", "m.obj.exe", ""}) {
    try {
      decode_mesh(name, bytes_of("v 0 0 0"), kLimits);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::unsupported);
    }
  }
  EXPECT_NO_THROW(decode_mesh("M.OBJ", bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"), kLimits));
}

const std::string kSquareHeader =
    "comment by hand\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty uchar quality\n"
    "property float s\nproperty float t\nelement material 2\nproperty list uchar short ids\n"
    "element face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";

void expect_square(const Mesh& mesh) {
  EXPECT_EQ(mesh.positions, (Vectors{{0, 0, -1}, {1, 0, -1}, {1, 1, -1}, {0, 1, -1}}));
  EXPECT_EQ(mesh.normals, (Vectors{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}));
  EXPECT_EQ(mesh.uvs, (Pairs{{0, 0}, {0.5F, 0}, {0.5F, 0.25F}, {0, 0.25F}}));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

std::vector<std::byte> binary_square(bool big_endian) {
  Writer file(big_endian);
  file.text(big_endian ? "ply\nformat binary_big_endian 1.0\n"
                       : "ply\nformat binary_little_endian 1.0\n");
  file.text(kSquareHeader);
  const std::array<std::array<float, 2>, 4> corners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (const auto& [x, y] : corners) {
    file.put(x).put(double{y}).put(-1.0F).put(0.0F).put(0.0F).put(1.0F);
    file.put(std::uint8_t{200}).put(0.5F * x).put(0.25F * y);
  }
  file.put(std::uint8_t{2}).put(std::int16_t{-1}).put(std::int16_t{7}).put(std::uint8_t{0});
  file.put(std::uint8_t{9}).put(std::uint8_t{4}).put_all<std::int32_t>({0, 1, 2, 3});
  return file.bytes();
}

TEST(PlyFile, ReadsAsciiAndBothByteOrders) {
  expect_square(ply(binary_square(false)));
  expect_square(ply(binary_square(true)));
  const std::string text = "ply\nformat ascii 1.0\n" + kSquareHeader +
                           "0 0 -1 0 0 1 200 0 0\n1 0 -1 0 0 1 200 0.5 0\n"
                           "1 1 -1 0 0 1 200 0.5 0.25\n0 1 -1 0 0 1 200 0 +0.25\n"
                           "2 -1 7\n0\n9 4 0 1 2 3\n";
  expect_square(ply(bytes_of(text)));
  std::string dos;
  for (const char c : text) dos += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_square(ply(bytes_of(dos)));
}

TEST(PlyFile, KnowsTheOtherNames) {
  const std::string text =
      "ply\nformat ascii 1.0\nobj_info x\nelement vertex 3\nproperty float32 x\n"
      "property float64 y\nproperty int16 z\nproperty float texture_u\nproperty float texture_v\n"
      "property float nx\nelement face 1\nproperty list uint8 uint32 vertex_index\nend_header\n"
      "0 0 0 0 1 0\n1 0 0 0 1 0\n0 1 0 0 1 0\n3 0 1 2";
  const Mesh mesh = ply(bytes_of(text));
  EXPECT_EQ(mesh.uvs, (Pairs{{0, 1}, {0, 1}, {0, 1}}));
  EXPECT_TRUE(mesh.normals.empty());  // ny and nz are missing
}

TEST(PlyFile, RefusesBrokenFiles) {
  const std::string ascii = "ply\nformat ascii 1.0\n";
  const std::string v = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string f = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string e = "end_header\n";
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "the header has no end"},
      {"plx\n", "is not a PLY file"},
      {"ply\n", "the header has no end"},
      {"ply\n" + v + f + e + points, "names no format"},
      {"ply\nformat utf8 1.0\n", "format is unknown"},
      {"ply\nformat ascii 2.0\n", "line 2 is malformed"},
      {ascii + "property float x\n", "line 3 is malformed"},
      {ascii + "element vertex many\n", "line 3 has no count"},
      {ascii + "element vertex -1\n", "line 3 has no count"},
      {ascii + v + "property half w\n", "line 7 is malformed"},
      {ascii + v + "property list float x\n", "line 7 is malformed"},
      {ascii + v + f + e, "its header promises 3 x vertex"},
      {ascii + v + e + points, "no triangle"},
      {ascii + f + e + "3 0 1 2\n", "holds no vertex"},
      {ascii + "element vertex 3\nproperty float x\n" + f + e + "0 1 2\n3 0 1 2", "no x, y, z"},
      {ascii + v + "element face 1\nproperty int a\n" + e + points + "3", "no vertex_indices"},
      {ascii + v + f + e + points + "3 0 1", "is truncated or malformed at face 0"},
      {ascii + v + f + e + "0 0 0\n1 0 x\n0 1 0\n3 0 1 2", "malformed at vertex 1"},
      {ascii + v + f + e + points + "2 0 1", "face 0 has fewer than three"},
      {ascii + v + f + e + points + "-3 0 1 2", "impossible length"},
      {ascii + v + f + e + points + "3 0 1 3", "triangle 0 asks for vertex 3 of 3"},
      {ascii + v + f + e + points + "3 0 1 -1", "face 0 has an index out of range"},
      {ascii + v + f + e + points + "3 0 1 1.5", "face 0 has an index out of range"},
      {ascii + v + f + e + "0 0 0\n1 0 nan\n0 1 0\n3 0 1 2", "vertex 1 is not finite"},
      {ascii + v + f + e + "0 0 0\n1 0 2e7\n0 1 0\n3 0 1 2", "vertex 1 is not finite or lies"},
      {ascii + "element vertex 18446744073709551615\nproperty float x\n" + e, "promises"},
      {ascii + "element face 4000000000\nproperty list uchar int vertex_indices\n" + e,
       "promises"}};
  for (const auto& [text, part] : cases) expect_bad("m.ply", bytes_of(text), part);
}

// Counts and lengths that the rest of the file cannot hold are refused before they are believed.
TEST(PlyFile, RefusesBinaryPromisesItCannotKeep) {
  const std::string start = "ply\nformat binary_little_endian 1.0\n";
  const std::string v = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string list = "property list uint int vertex_indices\nend_header\n";
  Writer file;
  file.text(start + v + "element face 1\n" + list).put(0.0F).put(0.0F).put(0.0F);
  file.put(std::numeric_limits<std::uint32_t>::max());
  expect_bad("m.ply", file.bytes(), "impossible length");
  Writer other;
  other.text(start + v + "element odd 1\n" + list).put(0.0F).put(0.0F).put(0.0F);
  other.put(std::numeric_limits<std::uint32_t>::max());
  expect_bad("m.ply", other.bytes(), "impossible length");
  expect_bad("m.ply", bytes_of(start + "element void 18446744073709551615\n" + v + "end_header\n"),
             "promises 1 x vertex");
  const std::vector<std::byte> whole = binary_square(false);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    expect_bad("m.ply", {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}, "");
  }
}

TEST(PlyFile, KeepsToTheLimits) {
  AssetLimits limits = kLimits;
  limits.max_triangles = 2;
  EXPECT_NO_THROW(ply(binary_square(false), limits));
  limits.max_triangles = 1;  // and 3 vertices
  expect_bad("m.ply", binary_square(false), "more than 3 vertices", limits);
}

}  // namespace
}  // namespace fstop
