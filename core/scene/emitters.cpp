#include "core/scene/emitters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/build_stop.h"
#include "core/scene/mapping.h"
#include "core/scene/mesh_islands.h"

namespace fstop {
namespace {

constexpr float kWhite = 1.0F;
// Finding islands sorts edges: 0.4 s for as many. Larger meshes are no heaps of small bulbs.
constexpr std::size_t kMostTriangles = std::size_t{1} << 20;
constexpr float kFarBelowBrightest = 1.0F / 16.0F;

float brightest(const Rgb& color) { return std::max({color[0], color[1], color[2]}); }

bool emits(const Material& material) {
  return brightest(material.emission.value) > 0.0F && !(material.reflection > 0.0) &&
         !(material.transmission > 0.0);
}

Vec3 position(const Mesh& mesh, std::uint32_t i) {
  const auto& p = mesh.positions[i];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

// A sphere around the triangles: about the middle of their box.
void bound(const Mesh& mesh, Emitter& emitter) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  Vec3 low{kLargest, kLargest, kLargest};
  Vec3 high = -low;
  const auto each_corner = [&](const auto& visit) {
    for (const std::uint32_t i : emitter.triangles) {
      for (const std::uint32_t corner : mesh.triangles[i]) visit(position(mesh, corner));
    }
  };
  each_corner([&](Vec3 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  });
  emitter.center = (low + high) * 0.5;
  each_corner([&](Vec3 p) { emitter.radius = std::max(emitter.radius, norm(p - emitter.center)); });
}

// Whether all corners lie in the plane of the largest triangle, but for roundings.
bool is_flat(const Mesh& mesh, const Emitter& emitter) {
  Vec3 normal = {};
  Vec3 origin = {};
  for (const std::uint32_t i : emitter.triangles) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = position(mesh, t[0]);
    const Vec3 across = cross(position(mesh, t[1]) - a, position(mesh, t[2]) - a);
    if (norm(across) <= norm(normal)) continue;
    normal = across;
    origin = a;
  }
  const double room = 1e-5 * emitter.radius * norm(normal);
  return std::ranges::all_of(emitter.triangles, [&](std::uint32_t i) {
    return std::ranges::all_of(mesh.triangles[i], [&](std::uint32_t corner) {
      return std::abs(dot(position(mesh, corner) - origin, normal)) <= room;
    });
  });
}

Rgb mean_of(const Texture& texture, const Rgb& scale) {
  const Rgb mean = texture.sample(0.5F, 0.5F, texture.texels_per_uv());
  return {mean[0] * scale[0], mean[1] * scale[1], mean[2] * scale[2]};
}

// What a mapping by position puts onto a triangle's middle, as blurred as the triangle is large.
Rgb mapped_emission(const ColorSource& source, const Texture& texture, const SurfaceMap& map,
                    const std::array<Vec3, 3>& corners) {
  const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const UvPoint middle = map.at(to_float((corners[0] + corners[1] + corners[2]) * (1.0 / 3.0)));
  const auto side = static_cast<float>(std::sqrt(0.5 * norm(normal)));
  const float uv = side * uv_rate(middle, normalized(to_float(normal)));
  const Rgb color = texture.sample(middle.u, middle.v, uv * texture.texels_per_uv());
  return {color[0] * source.value[0], color[1] * source.value[1], color[2] * source.value[2]};
}

// A triangle's mean emission: its texture at the middle, as blurred as the triangle is large; of
// one that is fixed to the picture, the whole texture's.
Rgb triangle_emission(const ColorSource& source, std::span<const Texture> textures,
                      const Mapping& mapping, const Mesh& mesh,
                      const std::array<std::uint32_t, 3>& t) {
  if (source.texture < 0) return source.value;
  const Texture& texture = textures[static_cast<std::size_t>(source.texture)];
  if (std::holds_alternative<ScreenMapping>(mapping)) return mean_of(texture, source.value);
  if (maps_by_position(mapping)) {
    return mapped_emission(source, texture, SurfaceMap(mapping),
                           {position(mesh, t[0]), position(mesh, t[1]), position(mesh, t[2])});
  }
  std::array<std::array<float, 2>, 3> uv = {};
  if (!mesh.uvs.empty()) uv = {mesh.uvs[t[0]], mesh.uvs[t[1]], mesh.uvs[t[2]]};
  const float uv_area = 0.5F * std::abs((uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) -
                                        (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]));
  const Rgb color = texture.sample((uv[0][0] + uv[1][0] + uv[2][0]) / 3.0F,
                                   (uv[0][1] + uv[1][1] + uv[2][1]) / 3.0F,
                                   std::sqrt(uv_area) * texture.texels_per_uv());
  return {color[0] * source.value[0], color[1] * source.value[1], color[2] * source.value[2]};
}

Emitter island_emitter(std::uint32_t object, MeshIsland island, const Mesh& mesh,
                       const ColorSource& emission, const Mapping& mapping,
                       std::span<const Texture> textures) {
  Emitter emitter{
      .object = object, .triangles = std::move(island.triangles), .outwards = island.outwards};
  bound(mesh, emitter);
  emitter.flat = is_flat(mesh, emitter);
  std::array<double, 3> light = {};
  for (const std::uint32_t i : emitter.triangles) {
    const auto& t = mesh.triangles[i];
    const Vec3 a = position(mesh, t[0]);
    const double area = 0.5 * norm(cross(position(mesh, t[1]) - a, position(mesh, t[2]) - a));
    const Rgb color = triangle_emission(emission, textures, mapping, mesh, t);
    emitter.area += area;
    for (std::size_t c = 0; c < 3; ++c) light[c] += area * static_cast<double>(color[c]);
  }
  if (!(emitter.area > 0.0)) return emitter;
  for (std::size_t c = 0; c < 3; ++c) {
    emitter.radiance[c] = static_cast<float>(light[c] / emitter.area);
  }
  return emitter;
}

Emitter sphere_emitter(std::uint32_t object, const SphereObject& sphere,
                       const ColorSource& emission, std::span<const Texture> textures) {
  // Embree's spheres have single precision: the same sphere must be splatted.
  const Vec3f center = to_float(sphere.center);
  const auto radius = double{static_cast<float>(sphere.radius)};
  Emitter emitter{.object = object,
                  .outwards = 1,
                  .center = {double{center.x}, double{center.y}, double{center.z}},
                  .radius = radius,
                  .area = 4.0 * std::numbers::pi * radius * radius,
                  .radiance = emission.value};
  if (emission.texture >= 0) {
    emitter.radiance =
        mean_of(textures[static_cast<std::size_t>(emission.texture)], emission.value);
  }
  return emitter;
}

// The brightest that any triangle of an object may be; 0 where it is no emitter.
float peak_emission(const Scene& scene, const Object& object, std::span<const Texture> textures) {
  const Material& material = scene.materials[static_cast<std::size_t>(object.material)];
  if (!emits(material) || object.velocity != Vec3{}) return 0.0F;
  const ColorSource& emission = material.emission;
  const auto* object_mesh = std::get_if<MeshObject>(&object.shape);
  if (object_mesh == nullptr) {
    const auto& sphere = std::get<SphereObject>(object.shape);
    return brightest(sphere_emitter(0, sphere, emission, textures).radiance);
  }
  const Mesh& mesh = object_mesh->mesh;
  if (mesh.triangles.size() > kMostTriangles) return 0.0F;
  if (emission.texture < 0) return brightest(emission.value);
  float peak = 0.0F;
  for (const auto& t : mesh.triangles) {
    peak =
        std::max(peak, brightest(triangle_emission(emission, textures, object.mapping, mesh, t)));
  }
  return peak;
}

// Coordinates in which emitters of a group should be alike, in units that weigh the same.
using Features = std::array<double, 4>;

std::vector<Features> features_of(std::span<const Emitter> emitters) {
  // The whole extent of the scene's emitters weighs as much as two octaves of size.
  constexpr double kExtentWeight = 2.0;
  double extent = 0.0;
  for (const Emitter& emitter : emitters) {
    const Vec3 offset = emitter.center - emitters.front().center;
    extent = std::max({extent, std::abs(offset.x), std::abs(offset.y), std::abs(offset.z)});
  }
  const double weight = extent > 0.0 ? kExtentWeight / extent : 0.0;
  std::vector<Features> features;
  features.reserve(emitters.size());
  for (const Emitter& emitter : emitters) {
    const Vec3 place = emitter.center * weight;
    const double size = std::log2(std::max(emitter.radius, 1e-30));
    features.push_back({size, place.x, place.y, place.z});
  }
  return features;
}

// Emitters that share a group so far, and the axis along which they differ most.
struct Cell {
  std::vector<std::uint32_t> members = {};
  std::size_t axis = 0;
  double low = 0.0;
  double high = 0.0;
};

Cell cell_of(std::vector<std::uint32_t> members, const std::vector<Features>& features) {
  Cell cell{.members = std::move(members)};
  for (std::size_t axis = 0; axis < 4; ++axis) {
    const auto [low, high] =
        std::ranges::minmax(cell.members, {}, [&](std::uint32_t i) { return features[i][axis]; });
    if (features[high][axis] - features[low][axis] <= cell.high - cell.low) continue;
    cell.axis = axis;
    cell.low = features[low][axis];
    cell.high = features[high][axis];
  }
  return cell;
}

}  // namespace

void assign_groups(std::span<Emitter> emitters) {
  if (emitters.empty()) return;
  const std::vector<Features> features = features_of(emitters);
  std::vector<std::uint32_t> all(emitters.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  std::vector<Cell> cells;
  cells.push_back(cell_of(std::move(all), features));
  while (cells.size() < static_cast<std::size_t>(kEmitterGroups)) {
    const auto widest =
        std::ranges::max_element(cells, {}, [](const Cell& c) { return c.high - c.low; });
    if (!(widest->high > widest->low)) break;
    const double middle = 0.5 * (widest->low + widest->high);
    const auto upper = std::ranges::stable_partition(
        widest->members, [&](std::uint32_t i) { return features[i][widest->axis] <= middle; });
    std::vector<std::uint32_t> above(upper.begin(), upper.end());
    std::vector<std::uint32_t> below(widest->members.begin(), upper.begin());
    if (above.empty() || below.empty()) break;  // values so near that their middle is one of them
    *widest = cell_of(std::move(below), features);
    cells.push_back(cell_of(std::move(above), features));
  }
  for (std::size_t group = 0; group < cells.size(); ++group) {
    for (const std::uint32_t i : cells[group].members) {
      emitters[i].group = static_cast<int>(group) + 1;
    }
  }
}

std::vector<Emitter> find_emitters(const Scene& scene, std::span<const Texture> textures) {
  std::vector<float> peaks(scene.objects.size());
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    BuildStop::throw_if_requested();
    peaks[i] = peak_emission(scene, scene.objects[i], textures);
  }
  const float most = peaks.empty() ? 0.0F : std::ranges::max(peaks);
  const float threshold = most > kWhite ? kWhite : kFarBelowBrightest * most;
  std::vector<Emitter> emitters;
  const auto add = [&](Emitter emitter) {
    const bool is_bright = brightest(emitter.radiance) > threshold && emitter.area > 0.0;
    if (is_bright) emitters.push_back(std::move(emitter));
  };
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (!(peaks[i] > threshold)) continue;
    BuildStop::throw_if_requested();
    const Object& object = scene.objects[i];
    const ColorSource& emission =
        scene.materials[static_cast<std::size_t>(object.material)].emission;
    const auto number = static_cast<std::uint32_t>(i);
    if (const auto* sphere = std::get_if<SphereObject>(&object.shape)) {
      add(sphere_emitter(number, *sphere, emission, textures));
    } else if (const auto* mesh = std::get_if<MeshObject>(&object.shape)) {
      for (MeshIsland& island : mesh_islands(mesh->mesh)) {
        add(island_emitter(number, std::move(island), mesh->mesh, emission, object.mapping,
                           textures));
      }
    }
  }
  assign_groups(emitters);
  return emitters;
}

float brightest_radiance(const Scene& scene) {
  float brightest = std::ranges::max(scene.background);
  for (const Material& material : scene.materials) {
    const ColorSource& emission = material.emission;
    float value = std::ranges::max(emission.value);
    if (emission.texture >= 0 && value > 0.0F) {
      const Image& image = scene.textures[static_cast<std::size_t>(emission.texture)].image;
      value *= image.empty() ? 1.0F : std::ranges::max(image.pixels());
    }
    brightest = std::max(brightest, value);
  }
  return brightest;
}

}  // namespace fstop
