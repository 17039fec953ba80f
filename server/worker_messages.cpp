#include "server/worker_messages.h"

#include <algorithm>
#include <concepts>
#include <new>
#include <type_traits>

namespace fstop::server {

// For both directions: const for the writer. In the namespace of the structs, where they are found.
template <typename T, typename Struct>
concept Is = std::same_as<std::remove_const_t<T>, Struct>;

}  // namespace fstop::server

namespace fstop {

using server::Is;
using server::Plain;
static_assert(Plain<CameraSpec> && Plain<EffectChoices> && Plain<ImageError> && Plain<RenderCost>);
static_assert(Plain<ObjectPlane> && Plain<Light> && Plain<SphereObject> && Plain<QuadObject>);

template <typename Stream>
void pass(Stream& stream, Is<QualitySpec> auto& quality) {
  stream(quality.max_error, quality.max_time_ms, quality.method, quality.samples,
         quality.most_samples);
}

template <typename Stream>
void pass(Stream& stream, Is<SimulationSpec> auto& spec) {
  stream(spec.camera, spec.width, spec.height, spec.quality, spec.effects, spec.outputs, spec.seed);
}

template <typename Stream>
void pass(Stream& stream, Is<ModelledEffect> auto& effect) {
  stream(effect.effect, effect.modelled, effect.bound, effect.why);
}

template <typename Stream>
void pass(Stream& stream, Is<PassedOverMethod> auto& method) {
  stream(method.method, method.why);
}

template <typename Stream>
void pass(Stream& stream, Is<OpticalSummary> auto& optics) {
  stream(optics.image_distance, optics.magnification, optics.near, optics.far, optics.hyperfocal,
         optics.coc_limit, optics.working_f_number, optics.airy_diameter, optics.view_angle,
         optics.focal_px, optics.principal_point, optics.illuminance_on_axis,
         optics.illuminance_at_corner, optics.at);
}

template <typename Stream>
void pass(Stream& stream, Is<RenderReport> auto& report) {
  stream(report.method, report.model, report.passed_over, report.error, report.optics, report.cost,
         report.warnings);
}

template <typename Stream>
void pass(Stream& stream, Is<Photograph> auto& photograph) {
  stream(photograph.report, photograph.color, photograph.layers);
}

template <typename Stream>
void pass(Stream& stream, Is<TextureSource> auto& texture) {
  stream(texture.name, texture.file, texture.color_space, texture.filter, texture.wrap,
         texture.image);
}

template <typename Stream>
void pass(Stream& stream, Is<Material> auto& material) {
  stream(material.name, material.model, material.emission, material.ambient, material.diffuse,
         material.specular, material.shininess, material.reflection, material.transmission,
         material.ior);
}

template <typename Stream>
void pass(Stream& stream, Is<Mesh> auto& mesh) {
  stream(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles);
}

template <typename Stream>
void pass(Stream& stream, Is<MeshObject> auto& object) {
  stream(object.file, object.interpolation, object.mesh);
}

template <typename Stream>
void pass(Stream& stream, Is<Object> auto& object) {
  stream(object.shape, object.material, object.velocity);
}

template <typename Stream>
void pass(Stream& stream, Is<Scene> auto& scene) {
  stream(scene.title, scene.description, scene.textures, scene.materials, scene.objects,
         scene.lights, scene.ambient_light, scene.background);
}

}  // namespace fstop

namespace fstop::server {

template <typename Stream>
void pass(Stream& stream, Is<WorkerJob> auto& job) {
  stream(job.spec, job.scene_hash, job.wants_previews);
}

template <typename Stream>
void pass(Stream& stream, Is<WorkerResult> auto& result) {
  stream(result.photograph, result.cpu_ms, result.build_ms);
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
    return layer.first > Output::color && layer.first <= Output::normal;
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
