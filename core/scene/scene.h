#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/film/image.h"
#include "core/geometry.h"

namespace fstop {

/// Linear Rec. 709.
using Rgb = std::array<float, 3>;

enum class TextureFilter {
  nearest,
  bilinear,
  mipmap,
  summed_area,
  brute_force,
  stochastic,
  anisotropic
};
enum class TextureWrap { repeat, clamp };
enum class ColorSpace { srgb, linear };

/// An image put onto surfaces. `image` is linear RGB, row 0 at the top (v = 1 side).
struct TextureSource {
  std::string name = {};
  std::string file = {};
  ColorSpace color_space = ColorSpace::srgb;  // how the file's values are encoded
  TextureFilter filter = TextureFilter::mipmap;
  TextureWrap wrap = TextureWrap::repeat;
  Image image = {};  // filled by load_assets
};

/// A constant colour, or a texture times `value`.
struct ColorSource {
  Rgb value = {0.0F, 0.0F, 0.0F};
  int texture = -1;  // index into Scene::textures; -1: none
};

/// Heights over a surface, as a texture's values (the mean of its channels) times `scale`: the
/// shading normal tilts with their slope.
struct BumpMap {
  int texture = -1;    // index into Scene::textures; -1: none
  double scale = 0.0;  // metres from black to white; negative: white is deep
};

/// Normals in the frame of u, v and the surface's normal, as a texture's values 2 c - 1 (glTF's
/// convention: red along u, green along v, blue outwards); red and green are multiplied by `scale`.
struct NormalMap {
  int texture = -1;  // index into Scene::textures; -1: none
  double scale = 1.0;
};

enum class ShadingModel { unlit, phong, blinn_phong };

struct Material {
  std::string name = {};
  ShadingModel model = ShadingModel::unlit;
  ColorSource emission = {};
  ColorSource ambient = {};
  ColorSource diffuse = {};
  ColorSource specular = {};
  double shininess = 1.0;
  double reflection = 0.0;
  double transmission = 0.0;
  std::optional<double> ior = {};
  bool fresnel = false;  // with ior: shares follow Fresnel's equations
  /// Light leaves about the ideal direction with a density of cos^n; absent: in that direction.
  std::optional<double> reflection_exponent = {};    // gloss
  std::optional<double> transmission_exponent = {};  // frosting
  BumpMap bump = {};                                 // slopes of both maps add
  NormalMap normal_map = {};
};

enum class Interpolation { flat, gouraud, phong };

/// Triangles. `normals` and `uvs` are empty or as long as `positions`.
struct Mesh {
  std::vector<std::array<float, 3>> positions = {};
  std::vector<std::array<float, 3>> normals = {};
  std::vector<std::array<float, 2>> uvs = {};  // v up: v = 0 is the bottom row of a texture
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
};

/// Where a mesh is put, whatever coordinates its file has: scaled so that the largest side of its
/// bounding box is `size`, turned about that box's vertical axis, its centre moved to `center`.
struct Placement {
  Vec3 center = {};
  double size = 1.0;  // metres, > 0
  double turn = 0.0;  // radians about +y, from +z towards +x
};

struct MeshObject {
  std::string file = {};
  Interpolation interpolation = Interpolation::phong;
  std::optional<double> crease_angle = {};  // radians: normals are averaged from faces up to it
  Mesh mesh = {};                           // filled by load_assets
  std::optional<Placement> placement = {};  // done by api/scene_assets once the mesh is there
};
struct SphereObject {
  Vec3 center = {};
  double radius = 1.0;  // metres, > 0
};
struct QuadObject {
  Vec3 corner = {};
  Vec3 edge_u = {1.0, 0.0, 0.0};
  Vec3 edge_v = {0.0, 1.0, 0.0};
};

/// The shape's own coordinates: a mesh's uv, a quad's edges, a sphere's longitude and latitude.
struct OwnMapping {};
/// As a quad's: (0, 0) at `origin`, (1, 0) at origin + edge_u, (0, 1) at origin + edge_v; what lies
/// off that plane is projected along its normal.
struct PlanarMapping {
  Vec3 origin = {};
  Vec3 edge_u = {1.0, 0.0, 0.0};  // metres, at least kSmallestPeriod long
  Vec3 edge_v = {0.0, 1.0, 0.0};
};
/// As a sphere's about `origin`: u the longitude about `axis`, 0 to `around`, whose middle lies
/// towards `front`; v the latitude, 0 to 1 from pole to pole.
struct SphericalMapping {
  Vec3 origin = {};
  Vec3 axis = {0.0, 1.0, 0.0};   // towards v = 1, any length but zero
  Vec3 front = {0.0, 0.0, 1.0};  // not along the axis
  int around = 1;                // times that the texture goes round
};
/// u as of SphericalMapping; v the distance from `origin` along `axis`, in heights.
struct CylindricalMapping {
  Vec3 origin = {};
  Vec3 axis = {0.0, 1.0, 0.0};
  Vec3 front = {0.0, 0.0, 1.0};
  double height = 1.0;  // metres for v to run from 0 to 1, at least kSmallestPeriod
  int around = 1;
};
/// The film position of the sample: (0, 0) at the picture's lower left corner, (1, 1) at the upper
/// right. The texture stays fixed to the picture, of which the object cuts out its shape.
struct ScreenMapping {};

/// Where an object's points look textures up; positions in the world at time 0, and moving with
/// the object.
using Mapping =
    std::variant<OwnMapping, PlanarMapping, SphericalMapping, CylindricalMapping, ScreenMapping>;

struct Object {
  std::variant<MeshObject, SphereObject, QuadObject> shape = {};
  int material = 0;    // index into Scene::materials
  Vec3 velocity = {};  // metres per second
  Mapping mapping = {};
};

/// 1/(a0 + a1 d + a2 d^2), d in metres.
struct Attenuation {
  double a0 = 1.0;
  double a1 = 0.0;
  double a2 = 0.0;
};
struct DirectionalLight {
  Vec3 direction = {0.0, -1.0, 0.0};  // the way the light travels
};
struct PointLight {
  Vec3 position = {};
  Attenuation attenuation = {};
};
struct SpotLight {
  Vec3 position = {};
  Vec3 direction = {0.0, -1.0, 0.0};
  double exponent = 1.0;
  Attenuation attenuation = {};
};
struct AreaLight {
  Vec3 corner = {};
  Vec3 edge_u = {};
  Vec3 edge_v = {};
  Attenuation attenuation = {};
};
struct Light {
  std::variant<DirectionalLight, PointLight, SpotLight, AreaLight> kind = {};
  Rgb intensity = {0.0F, 0.0F, 0.0F};
};

/// What is photographed: plain values, right-handed, metres, +y up, colours linear Rec. 709.
struct Scene {
  std::string title = {};
  std::string description = {};
  std::vector<TextureSource> textures = {};
  std::vector<Material> materials = {};
  std::vector<Object> objects = {};
  std::vector<Light> lights = {};
  Rgb ambient_light = {0.0F, 0.0F, 0.0F};
  Rgb background = {0.0F, 0.0F, 0.0F};
};

}  // namespace fstop
