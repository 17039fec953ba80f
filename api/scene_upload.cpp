#include "api/scene_upload.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/problem.h"
#include "api/scene_assets.h"
#include "core/error.h"

namespace fstop::api {
namespace {

constexpr std::string_view kSceneFile = "scene.json";
constexpr std::string_view kModelFile = "model.glb";

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

bool begins_with(std::span<const std::byte> bytes, std::string_view mark) {
  return text_of(bytes).starts_with(mark);
}

const ArchiveEntry* find(const std::vector<ArchiveEntry>& files, std::string_view name) {
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const ArchiveEntry& file) { return file.name == name; });
  return found == files.end() ? nullptr : &*found;
}

struct Loaded {
  std::string hash = {};
  std::size_t objects = 0;
  std::size_t lights = 0;
  std::vector<std::string> unused = {};  // files that the scene does not name
};

// Decodes everything once.
Loaded loaded(const std::vector<ArchiveEntry>& files, const Limits& limits) {
  const ArchiveEntry* document = find(files, kSceneFile);
  if (document == nullptr)
    throw InvalidRequest(FieldFault{"#", "the archive has no scene.json at its top"});
  if (document->bytes.size() > limits.scene_bytes)
    throw Error(ErrorCode::over_budget, "scene.json has too many bytes");
  Loaded result;
  std::vector<std::string> used = {std::string(kSceneFile)};
  const AssetReader read = [&](const std::string& name) {
    const ArchiveEntry* file = find(files, name);
    if (file == nullptr) throw Error(ErrorCode::not_found, "the archive has no file " + name);
    if (file->bytes.size() > limits.assets.max_file_bytes)
      throw Error(ErrorCode::over_budget, name + " has too many bytes");
    used.push_back(name);
    return file->bytes;
  };
  const LoadedScene scene =
      load_scene(parse_scene_text(text_of(document->bytes), limits), read, "#", limits);
  result.hash = scene.hash;
  result.objects = scene.scene.objects.size();
  result.lights = scene.scene.lights.size();
  for (const ArchiveEntry& file : files) {
    if (std::find(used.begin(), used.end(), file.name) == used.end())
      result.unused.push_back(file.name);
  }
  return result;
}

void append_number(std::string& text, std::size_t number) {
  text += std::to_string(number);
  text += '\n';
}

// The number before the next line break, taken off.
std::size_t take_number(std::string_view& text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto digits = static_cast<std::size_t>(end - text.data());
  if (error != std::errc() || digits >= text.size() || text[digits] != '\n')
    throw Error(ErrorCode::internal, "an upload's reader answered nonsense");
  text.remove_prefix(digits + 1);
  return number;
}

std::string_view take_text(std::string_view& text) {
  const std::size_t size = take_number(text);
  if (size > text.size())
    throw Error(ErrorCode::internal, "an upload's reader answered half of it");
  const std::string_view part = text.substr(0, size);
  text.remove_prefix(size);
  return part;
}

}  // namespace

UploadedScene read_upload(std::string_view name, std::span<const std::byte> bytes,
                          const Limits& limits) {
  UploadedScene scene;
  Json cameras = Json::array();
  std::vector<std::string> not_mapped;
  if (begins_with(bytes, "PK\x03\x04")) {
    scene.files = unzip(bytes, {});
  } else if (begins_with(bytes, "glTF")) {
    GltfScene made = scene_of_gltf(bytes, std::string(kModelFile), limits);
    scene.files = {{std::string(kSceneFile), bytes_of(made.scene)},
                   {std::string(kModelFile), {bytes.begin(), bytes.end()}}};
    cameras = Json::parse(made.cameras);
    not_mapped = std::move(made.not_mapped);
  } else {
    throw Error(ErrorCode::unsupported, "the file is neither a zip archive nor a .glb");
  }
  const Loaded seen = loaded(scene.files, limits);
  std::erase_if(scene.files, [&](const ArchiveEntry& file) {
    return std::find(seen.unused.begin(), seen.unused.end(), file.name) != seen.unused.end();
  });
  Json files = Json::array();
  for (const ArchiveEntry& file : scene.files)
    files.push_back({{"name", file.name}, {"bytes", file.bytes.size()}});
  const Json reply = {{"name", name},
                      {"hash", seen.hash},
                      {"objects", seen.objects},
                      {"lights", seen.lights},
                      {"files", std::move(files)},
                      {"passed_over", seen.unused},
                      {"cameras", std::move(cameras)},
                      {"not_mapped", not_mapped}};
  scene.reply = json_text(reply);
  return scene;
}

Problem problem_of_upload(std::string_view text) {
  const Error nonsense(ErrorCode::internal, "an upload's reader answered nonsense");
  Limits limits;
  if (text.size() > limits.problem_bytes + 1) throw nonsense;
  nlohmann::json value;
  try {
    value = parse_json(text, limits);
  } catch (const InvalidRequest&) {  // the client's request is not what is malformed
    throw nonsense;
  }
  const auto word = [&](const nlohmann::json& object, const char* key) {
    if (!object.is_object() || !object.contains(key) || !object.at(key).is_string()) throw nonsense;
    return object.at(key).get<std::string>();
  };
  const std::string type = word(value, "type");
  constexpr std::string_view kPrefix = "/problems/";
  const nlohmann::json& status = value.contains("status") ? value.at("status") : value;
  const bool is_refusal = status.is_number_unsigned() && status.get<unsigned>() >= 400 &&
                          status.get<unsigned>() < 500 && type.starts_with(kPrefix);
  if (!is_refusal) throw nonsense;
  Problem problem =
      http_problem(status.get<int>(), type.substr(kPrefix.size()), word(value, "detail"));
  if (!value.contains("errors")) return problem;
  for (const auto& error : value.at("errors"))
    problem.errors.push_back({word(error, "pointer"), word(error, "detail")});
  return problem;
}

std::string packed_upload(const UploadedScene& scene) {
  std::string text;
  append_number(text, scene.reply.size());
  text += scene.reply;
  append_number(text, scene.files.size());
  for (const ArchiveEntry& file : scene.files) {
    append_number(text, file.name.size());
    text += file.name;
    append_number(text, file.bytes.size());
    text += text_of(file.bytes);
  }
  return text;
}

UploadedScene unpacked_upload(std::string_view text) {
  UploadedScene scene;
  scene.reply = std::string(take_text(text));
  const std::size_t count = take_number(text);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name(take_text(text));
    if (!is_plain_name(name))
      throw Error(ErrorCode::internal, "an upload's reader answered a name that is none");
    scene.files.push_back({name, bytes_of(take_text(text))});
  }
  if (!text.empty() || find(scene.files, kSceneFile) == nullptr)
    throw Error(ErrorCode::internal, "an upload's reader answered something else");
  return scene;
}

}  // namespace fstop::api
