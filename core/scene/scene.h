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

enum class TextureFilter { nearest, bilinear, mipmap, summed_area, brute_force, stochastic };
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
};

enum class Interpolation { flat, gouraud, phong };

/// Triangles. `normals` and `uvs` are empty or as long as `positions`.
struct Mesh {
  std::vector<std::array<float, 3>> positions = {};
  std::vector<std::array<float, 3>> normals = {};
  std::vector<std::array<float, 2>> uvs = {};  // v up: v = 0 is the bottom row of a texture
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
};

struct MeshObject {
  std::string file = {};
  Interpolation interpolation = Interpolation::phong;
  std::optional<double> crease_angle = {};  // radians: normals are averaged from faces up to it
  Mesh mesh = {};                           // filled by load_assets
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

struct Object {
  std::variant<MeshObject, SphereObject, QuadObject> shape = {};
  int material = 0;    // index into Scene::materials
  Vec3 velocity = {};  // metres per second
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
