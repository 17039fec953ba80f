#pragma once

#include <cstddef>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/limits.h"
#include "api/problem.h"
#include "api/zip_archive.h"

namespace fstop::api {

/// A scene as it is to be stored, all of it decoded once to see that it can be.
struct UploadedScene {
  std::vector<ArchiveEntry> files = {};  // "scene.json" and what it names
  std::string reply = {};                // JSON for the client: what is there, what is not mapped
};

/// Reads a scene that was sent: a zip archive with `scene.json` and the files it names, or a .glb.
/// Of a .glb the meshes become one object with the first material's base colour; lights of
/// KHR_lights_punctual become lights, cameras are told as cameras of render requests; textures,
/// other materials, skins and animations are not mapped, and the reply says so.
/// Meant for a process that can do no harm: it works on foreign bytes.
/// Throws: Error{unsupported} for other kinds of files; InvalidRequest with the faults of the
///         scene; as unzip, parse_scene_text, load_scene.
UploadedScene read_upload(std::string_view name, std::span<const std::byte> bytes,
                          const Limits& limits);

/// The scene that a .glb is: text of its scene.json, cameras and what is not mapped.
struct GltfScene {
  std::string scene = {};
  std::string cameras = {};  // a JSON array
  std::vector<std::string> not_mapped = {};
};

/// `file`: how the scene calls the .glb. Throws: Error{bad_geometry} for what is no glTF 2.0.
GltfScene scene_of_gltf(std::span<const std::byte> bytes, const std::string& file,
                        const Limits& limits);

/// An upload that is refused, as another process found.
class UploadRefused : public std::exception {
 public:
  explicit UploadRefused(Problem problem) : problem_(std::move(problem)) {}
  const char* what() const noexcept override { return problem_.detail.c_str(); }
  const Problem& problem() const noexcept { return problem_; }

 private:
  Problem problem_;
};

/// The problem document `text`, which another process wrote: a refusal (4xx) of our own kinds.
/// Throws: Error{internal} for anything else.
Problem problem_of_upload(std::string_view text);

/// A result as one text, and back: how it leaves the process that made it.
std::string packed_upload(const UploadedScene& scene);
/// Throws: Error{internal} for what is no such text, or has a file of another than a plain name.
UploadedScene unpacked_upload(std::string_view text);

}  // namespace fstop::api
