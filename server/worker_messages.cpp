#include "server/worker_messages.h"

#include <algorithm>
#include <concepts>
#include <new>
#include <type_traits>

namespace fstop::server {

// For both directions: const for the writer. In the namespace of the structs, where they are found.
// All members are bound by name, so that none can be added and forgotten here.
template <typename T, typename Struct>
concept Is = std::same_as<std::remove_const_t<T>, Struct>;

}  // namespace fstop::server

namespace fstop {

using server::Is;
using server::Plain;
static_assert(Plain<CameraSpec> && Plain<EffectChoices> && Plain<ImageError> && Plain<RenderCost>);
static_assert(Plain<PatternChoice> && Plain<HalftoneSpec>);
static_assert(Plain<ObjectPlane> && Plain<Light> && Plain<SphereObject> && Plain<QuadObject>);
static_assert(Plain<Placement> && Plain<Mapping> && Plain<BumpMap> && Plain<NormalMap>);

template <typename Stream>
void pass(Stream& stream, Is<QualitySpec> auto& value) {
  auto& [max_error, max_time_ms, method, samples, sampling, texture_width_px, texture_disc_share,
         most_samples] = value;
  stream(max_error, max_time_ms, method, samples, sampling, texture_width_px, texture_disc_share,
         most_samples);
}

template <typename Stream>
void pass(Stream& stream, Is<SimulationSpec> auto& value) {
  auto& [camera, width, height, quality, effects, illumination, outputs, seed, halftone] = value;
  stream(camera, width, height, quality, effects, illumination, outputs, seed, halftone);
}

template <typename Stream>
void pass(Stream& stream, Is<ModelledEffect> auto& value) {
  auto& [effect, modelled, bound, why] = value;
  stream(effect, modelled, bound, why);
}

template <typename Stream>
void pass(Stream& stream, Is<PassedOverMethod> auto& value) {
  auto& [method, why] = value;
  stream(method, why);
}

template <typename Stream>
void pass(Stream& stream, Is<OpticalSummary> auto& value) {
  auto& [image_distance, magnification, near, far, hyperfocal, coc_limit, working_f_number,
         airy_diameter, view_angle, focal_px, principal_point, illuminance_on_axis,
         illuminance_at_corner, at] = value;
  stream(image_distance, magnification, near, far, hyperfocal, coc_limit, working_f_number,
         airy_diameter, view_angle, focal_px, principal_point, illuminance_on_axis,
         illuminance_at_corner, at);
}

template <typename Stream>
void pass(Stream& stream, Is<RenderReport> auto& value) {
  auto& [method, model, passed_over, error, alpha_error, optics, cost, warnings] = value;
  stream(method, model, passed_over, error, alpha_error, optics, cost, warnings);
}

template <typename Stream>
void pass(Stream& stream, Is<Photograph> auto& value) {
  auto& [report, color, layers] = value;
  stream(report, color, layers);
}

template <typename Stream>
void pass(Stream& stream, Is<TextureSource> auto& value) {
  auto& [name, file, color_space, filter, wrap, image] = value;
  stream(name, file, color_space, filter, wrap, image);
}

template <typename Stream>
void pass(Stream& stream, Is<Material> auto& value) {
  auto& [name, model, emission, ambient, diffuse, specular, shininess, reflection, transmission,
         ior, fresnel, reflection_exponent, transmission_exponent, bump, normal_map] = value;
  stream(name, model, emission, ambient, diffuse, specular, shininess, reflection, transmission,
         ior, fresnel, reflection_exponent, transmission_exponent, bump, normal_map);
}

template <typename Stream>
void pass(Stream& stream, Is<Mesh> auto& value) {
  auto& [positions, normals, uvs, triangles] = value;
  stream(positions, normals, uvs, triangles);
}

template <typename Stream>
void pass(Stream& stream, Is<MeshObject> auto& value) {
  auto& [file, interpolation, crease_angle, mesh, placement] = value;
  stream(file, interpolation, crease_angle, mesh, placement);
}

template <typename Stream>
void pass(Stream& stream, Is<Object> auto& value) {
  auto& [shape, material, velocity, mapping] = value;
  stream(shape, material, velocity, mapping);
}

template <typename Stream>
void pass(Stream& stream, Is<Scene> auto& value) {
  auto& [title, description, textures, materials, objects, lights, ambient_light, background] =
      value;
  stream(title, description, textures, materials, objects, lights, ambient_light, background);
}

}  // namespace fstop

namespace fstop::server {

template <typename Stream>
void pass(Stream& stream, Is<WorkerJob> auto& value) {
  auto& [spec, scene_hash, wants_previews] = value;
  stream(spec, scene_hash, wants_previews);
}

template <typename Stream>
void pass(Stream& stream, Is<WorkerResult> auto& value) {
  auto& [photograph, cpu_ms, build_ms] = value;
  stream(photograph, cpu_ms, build_ms);
}

namespace {

template <typename... Values>
std::string bytes_of(const Values&... values) {
  std::string bytes;
  ByteWriter writer([&](std::string_view part) { bytes += part; });
  writer(values...);
  return bytes;
}

template <typename Value>
Value value_of(std::string_view bytes) {
  Value value = {};
  ByteReader reader(bytes);
  reader(value);
  reader.require_end();
  return value;
}

template <typename Value>
MemoryFile file_with(const Value& value) {
  return MemoryFile::written([&](ByteWriter& writer) { writer(value); });
}

template <typename Value>
Value value_of(const MemoryFile& file) {
  Value value = {};
  file.read([&](std::string_view bytes) { value = value_of<Value>(bytes); });
  return value;
}

constexpr std::size_t kLongestReason = 4096;

// What is thrown where there is no memory, beside the codes of Error.
constexpr int kNoMemory = -1;

}  // namespace

std::string job_bytes(const WorkerJob& job) { return bytes_of(job); }
WorkerJob job_of(std::string_view bytes) { return value_of<WorkerJob>(bytes); }

MemoryFile result_file(const WorkerResult& result) { return file_with(result); }

WorkerResult result_of(const MemoryFile& file) {
  auto result = value_of<WorkerResult>(file);
  const auto is_known = [](const auto& layer) {
    return layer.first > Output::color && layer.first <= Output::alpha;
  };
  const bool is_whole =
      !result.photograph.color.empty() && std::ranges::all_of(result.photograph.layers, is_known);
  if (!is_whole) throw Error(ErrorCode::internal, "a worker sent no photograph");
  return result;
}

MemoryFile scene_file(const Scene& scene) { return file_with(scene); }
Scene scene_of(const MemoryFile& file) { return value_of<Scene>(file); }

MemoryFile image_file(const Image& image) { return file_with(image); }
Image image_of(const MemoryFile& file) { return value_of<Image>(file); }

std::string number_bytes(double number) { return bytes_of(number); }
double number_of(std::string_view bytes) { return value_of<double>(bytes); }

std::string failure_bytes(const std::exception& exception) {
  int code = static_cast<int>(ErrorCode::internal);
  if (const auto* error = dynamic_cast<const Error*>(&exception)) {
    code = static_cast<int>(error->code());
  } else if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) {
    code = kNoMemory;
  }
  return bytes_of(code, std::string(exception.what()).substr(0, kLongestReason));
}

void throw_failure(std::string_view bytes) {
  int code = 0;
  std::string reason;
  ByteReader reader(bytes);
  reader(code, reason);
  if (code == kNoMemory) throw std::bad_alloc();
  const bool is_known = code >= 0 && code <= static_cast<int>(ErrorCode::internal);
  throw Error(is_known ? static_cast<ErrorCode>(code) : ErrorCode::internal, reason);
}

}  // namespace fstop::server
