#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

// Pictures inside the file are not wanted, files outside it must not be touched.
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "core/geometry.h"
#include "core/scene/gltf_outline.h"
#include "core/scene/mesh_file.h"

namespace fstop {
namespace {

// The columns of a matrix and a translation: p -> x p.x + y p.y + z p.z + origin
struct Affine {
  Vec3 x = {1.0, 0.0, 0.0};
  Vec3 y = {0.0, 1.0, 0.0};
  Vec3 z = {0.0, 0.0, 1.0};
  Vec3 origin = {};

  Vec3 vector(Vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3 point(Vec3 p) const { return vector(p) + origin; }
  double determinant() const { return dot(cross(x, y), z); }
  // Normals go by the inverse transpose; times the determinant that is the matrix of cofactors.
  Vec3 normal(Vec3 n) const {
    const Vec3 turned = cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    return determinant() < 0.0 ? -turned : turned;
  }
};

Affine operator*(const Affine& parent, const Affine& child) {
  return {parent.vector(child.x), parent.vector(child.y), parent.vector(child.z),
          parent.point(child.origin)};
}

// The numbers of an accessor where they lie.
class Accessor {
 public:
  Accessor(const unsigned char* first, std::size_t stride, std::size_t count, int type,
           bool normalized)
      : first_(first), stride_(stride), count_(count), type_(type), normalized_(normalized) {}

  std::size_t count() const { return count_; }

  // glTF 2.0, 3.6.2.2 and 3.11: integers that are `normalized` stand for c / max.
  double at(std::size_t item, std::size_t part) const {
    switch (type_) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
        return scaled<std::int8_t>(item, part);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return scaled<std::uint8_t>(item, part);
      case TINYGLTF_COMPONENT_TYPE_SHORT:
        return scaled<std::int16_t>(item, part);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return scaled<std::uint16_t>(item, part);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return raw<std::uint32_t>(item, part);
      default:
        return static_cast<double>(raw<float>(item, part));
    }
  }
  Vec3 vector(std::size_t item) const { return {at(item, 0), at(item, 1), at(item, 2)}; }

 private:
  template <typename T>
  T raw(std::size_t item, std::size_t part) const {
    T value = {};
    std::memcpy(&value, first_ + item * stride_ + part * sizeof(T), sizeof(T));
    return value;
  }
  template <typename T>
  double scaled(std::size_t item, std::size_t part) const {
    const double value = raw<T>(item, part);
    return normalized_ ? std::max(value / std::numeric_limits<T>::max(), -1.0) : value;
  }

  const unsigned char* first_;
  std::size_t stride_;
  std::size_t count_;
  int type_;
  bool normalized_;
};

bool is_understood(const std::string& extension) {  // one that a file requires
  return extension.starts_with("KHR_materials_") || extension.starts_with("KHR_texture_") ||
         extension.starts_with("EXT_texture_") || extension == "KHR_lights_punctual" ||
         extension == "KHR_mesh_quantization";
}

class GltfReader {
 public:
  GltfReader(const std::string& name, const tinygltf::Model& model, const AssetLimits& limits)
      : name_(name), model_(model), limits_(limits), visited_(model.nodes.size()) {}

  Mesh read() {
    for (const std::string& extension : model_.extensionsRequired) {
      if (!is_understood(extension)) refuse("requires an extension that is not supported");
    }
    struct Visit {
      int node = 0;
      Affine world_from_parent = {};
    };
    std::vector<Visit> open;
    for (const int root : roots()) open.push_back({root});
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const tinygltf::Node& node = item(model_.nodes, visit.node, "node");
      const auto index = static_cast<std::size_t>(visit.node);
      if (visited_[index]) refuse("node " + std::to_string(visit.node) + " has two parents");
      visited_[index] = true;
      const Affine world_from_node = visit.world_from_parent * transform_of(node);
      if (node.mesh >= 0) add(item(model_.meshes, node.mesh, "mesh"), node, world_from_node);
      for (const int child : node.children) open.push_back({child, world_from_node});
    }
    if (!every_normal_) mesh_.normals.clear();
    if (!every_uv_) mesh_.uvs.clear();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const { refuse_mesh(name_, reason); }

  template <typename Item>
  const Item& item(const std::vector<Item>& items, int index, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= items.size()) {
      refuse("asks for " + std::string(what) + ' ' + std::to_string(index) + " of " +
             std::to_string(items.size()));
    }
    return items[static_cast<std::size_t>(index)];
  }

  std::vector<int> roots() const {
    if (!model_.scenes.empty()) {
      return item(model_.scenes, std::max(model_.defaultScene, 0), "scene").nodes;
    }
    std::vector<bool> is_child(model_.nodes.size());
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int child : node.children) {
        if (child >= 0 && static_cast<std::size_t>(child) < is_child.size()) {
          is_child[static_cast<std::size_t>(child)] = true;
        }
      }
    }
    std::vector<int> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(static_cast<int>(i));
    }
    return roots;
  }

  // A node's `matrix`, or its translation * rotation * scale.
  Affine transform_of(const tinygltf::Node& node) const {
    const auto has_size = [](const std::vector<double>& values, std::size_t size) {
      return values.empty() || values.size() == size;
    };
    const std::vector<double>& m = node.matrix;
    const std::vector<double>& t = node.translation;
    const std::vector<double>& q = node.rotation;
    const std::vector<double>& s = node.scale;
    if (!has_size(m, 16) || !has_size(t, 3) || !has_size(q, 4) || !has_size(s, 3)) {
      refuse("a node's transform has the wrong length");
    }
    if (!m.empty()) {
      return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
    }
    Affine result;
    if (!q.empty()) result = rotation(q);
    if (!s.empty()) {
      result.x = result.x * s[0];
      result.y = result.y * s[1];
      result.z = result.z * s[2];
    }
    if (!t.empty()) result.origin = {t[0], t[1], t[2]};
    return result;
  }

  // The rotation of a quaternion (x, y, z, w), which is made a unit one.
  Affine rotation(const std::vector<double>& q) const {
    const double squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(squares > 0.0)) refuse("a node's rotation has length 0");
    const double k = 2.0 / squares;
    const auto p = [&](std::size_t a, std::size_t b) { return k * q[a] * q[b]; };
    return {{1.0 - p(1, 1) - p(2, 2), p(0, 1) + p(2, 3), p(0, 2) - p(1, 3)},
            {p(0, 1) - p(2, 3), 1.0 - p(0, 0) - p(2, 2), p(1, 2) + p(0, 3)},
            {p(0, 2) + p(1, 3), p(1, 2) - p(0, 3), 1.0 - p(0, 0) - p(1, 1)},
            {}};
  }

  Accessor accessor(int index, int type) const {
    const tinygltf::Accessor& a = item(model_.accessors, index, "accessor");
    const auto what = "accessor " + std::to_string(index);
    if (a.sparse.isSparse) refuse(what + " is sparse, which is not supported");
    const tinygltf::BufferView& view = item(model_.bufferViews, a.bufferView, "buffer view");
    const tinygltf::Buffer& buffer = item(model_.buffers, view.buffer, "buffer");
    const int part_size =
        tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType));
    if (a.type != type || part_size <= 0 || a.componentType == TINYGLTF_COMPONENT_TYPE_INT ||
        a.componentType == TINYGLTF_COMPONENT_TYPE_DOUBLE) {
      refuse(what + " has the wrong type");
    }
    const std::size_t size = static_cast<std::size_t>(part_size) *
                             static_cast<std::size_t>(tinygltf::GetNumComponentsInType(
                                 static_cast<std::uint32_t>(type)));
    const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
    const std::size_t most = 3 * limits_.max_triangles;
    if (a.count == 0 || a.count > most) {
      refuse(what + " holds none or more than " + std::to_string(most) + " items");
    }
    // By subtraction, so that huge offsets do not wrap around.
    if (view.byteLength > buffer.data.size() ||
        view.byteOffset > buffer.data.size() - view.byteLength || a.byteOffset > view.byteLength ||
        size > view.byteLength - a.byteOffset ||
        (a.count - 1) > (view.byteLength - a.byteOffset - size) / stride) {
      refuse(what + " reaches beyond its buffer");
    }
    return {buffer.data.data() + view.byteOffset + a.byteOffset, stride, a.count, a.componentType,
            a.normalized};
  }

  void add(const tinygltf::Mesh& mesh, const tinygltf::Node& node, const Affine& world_from_mesh) {
    if (node.skin >= 0) refuse("has a skinned mesh, which is not supported");
    const auto moved = [](double weight) { return weight != 0.0; };
    if (std::any_of(mesh.weights.begin(), mesh.weights.end(), moved) ||
        std::any_of(node.weights.begin(), node.weights.end(), moved)) {
      refuse("has morph weights, which are not supported");
    }
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      if (primitive.mode == TINYGLTF_MODE_TRIANGLES) {
        add(primitive, world_from_mesh);
      } else if (primitive.mode > TINYGLTF_MODE_TRIANGLES || primitive.mode < 0) {
        refuse("has triangle strips or fans, which are not supported");
      }  // points and lines have no surface
    }
  }

  void add(const tinygltf::Primitive& primitive, const Affine& world_from_mesh) {
    const auto find = [&](const char* attribute) {
      const auto found = primitive.attributes.find(attribute);
      return found == primitive.attributes.end() ? -1 : found->second;
    };
    const int normal = find("NORMAL");
    const int uv = find("TEXCOORD_0");
    const Accessor positions = accessor(find("POSITION"), TINYGLTF_TYPE_VEC3);
    const std::size_t count = positions.count();
    const std::size_t base = mesh_.positions.size();
    if (count > 3 * limits_.max_triangles - base) {
      refuse("more than " + std::to_string(3 * limits_.max_triangles) + " vertices");
    }
    add_triangles(primitive.indices, base, count, world_from_mesh.determinant() < 0.0);
    for (std::size_t i = 0; i < count; ++i) {
      mesh_.positions.push_back(narrow(world_from_mesh.point(positions.vector(i))));
    }
    every_normal_ = every_normal_ && normal >= 0;
    if (every_normal_) {
      const Accessor normals = accessor_of(normal, TINYGLTF_TYPE_VEC3, count);
      for (std::size_t i = 0; i < count; ++i) {
        mesh_.normals.push_back(narrow(world_from_mesh.normal(normals.vector(i))));
      }
    }
    every_uv_ = every_uv_ && uv >= 0;
    if (every_uv_) {
      const Accessor uvs = accessor_of(uv, TINYGLTF_TYPE_VEC2, count);
      for (std::size_t i = 0; i < count; ++i) {
        mesh_.uvs.push_back(
            {static_cast<float>(uvs.at(i, 0)), static_cast<float>(1.0 - uvs.at(i, 1))});
      }
    }
  }

  Accessor accessor_of(int index, int type, std::size_t vertices) const {
    const Accessor values = accessor(index, type);
    if (values.count() != vertices) {
      refuse("accessor " + std::to_string(index) + " does not hold one item for each vertex");
    }
    return values;
  }

  // A mirroring transform turns the winding, so that the outside stays outside.
  void add_triangles(int indices, std::size_t base, std::size_t vertices, bool mirrored) {
    std::vector<std::uint32_t> corners;
    if (indices < 0) {
      for (std::size_t i = 0; i < vertices; ++i) corners.push_back(static_cast<std::uint32_t>(i));
    } else {
      const Accessor values = accessor(indices, TINYGLTF_TYPE_SCALAR);
      for (std::size_t i = 0; i < values.count(); ++i) {
        const double corner = values.at(i, 0);
        if (!(corner >= 0.0 && corner < static_cast<double>(vertices))) {
          refuse("index " + std::to_string(i) + " of accessor " + std::to_string(indices) +
                 " asks for a vertex beyond " + std::to_string(vertices));
        }
        corners.push_back(static_cast<std::uint32_t>(corner));
      }
    }
    if (corners.size() % 3 != 0) refuse("a triangle has fewer than three corners");
    if (corners.size() / 3 > limits_.max_triangles - mesh_.triangles.size()) {
      refuse("more than " + std::to_string(limits_.max_triangles) + " triangles");
    }
    const auto first = static_cast<std::uint32_t>(base);
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      const std::uint32_t b = first + corners[i + (mirrored ? 2 : 1)];
      const std::uint32_t c = first + corners[i + (mirrored ? 1 : 2)];
      mesh_.triangles.push_back({first + corners[i], b, c});
    }
  }

  static std::array<float, 3> narrow(Vec3 v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  }

  const std::string& name_;
  const tinygltf::Model& model_;
  const AssetLimits& limits_;
  std::vector<bool> visited_;
  bool every_normal_ = true;
  bool every_uv_ = true;
  Mesh mesh_ = {};
};

tinygltf::FsCallbacks no_files() {
  return {.FileExists = [](const std::string&, void*) { return false; },
          .ExpandFilePath = [](const std::string& path, void*) { return path; },
          .ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&,
                              void*) { return false; },
          .WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&,
                               void*) { return false; },
          .user_data = nullptr};
}

}  // namespace

Mesh decode_gltf(const std::string& name, std::span<const std::byte> bytes,
                 const AssetLimits& limits, bool binary) {
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (file.size() > std::numeric_limits<std::uint32_t>::max()) refuse_mesh(name, "is too large");
  check_gltf_outline(name, file, binary);

  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(no_files());
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int,
                           const unsigned char*, int, void*) { return true; },
                        nullptr);
  tinygltf::Model model;
  std::string error;
  std::string warning;
  const auto size = static_cast<unsigned int>(file.size());
  bool loaded = false;
  try {
    loaded = binary ? loader.LoadBinaryFromMemory(
                          &model, &error, &warning,
                          reinterpret_cast<const unsigned char*>(file.data()), size)
                    : loader.LoadASCIIFromString(&model, &error, &warning, file.data(), size, "");
  } catch (const std::exception&) {  // of the JSON library, where a member has the wrong type
    loaded = false;
  }
  if (!loaded || !model.asset.version.starts_with("2.")) {
    refuse_mesh(name, "is no complete glTF 2.0 file with embedded buffers");
  }
  return GltfReader(name, model, limits).read();
}

}  // namespace fstop
