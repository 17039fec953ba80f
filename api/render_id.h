#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fstop::api {

/// SHA-256 in 64 lower-case hexadecimal digits. Throws: Error{internal} if the library fails.
std::string sha256_hex(std::span<const std::byte> bytes);
std::string sha256_hex(std::string_view text);

/// A file that a scene uses.
struct AssetBytes {
  std::string name = {};  // as the scene calls it
  std::vector<std::byte> bytes = {};
};

/// The hash of a scene's content: its canonical JSON text, and name and bytes of every asset,
/// in whatever order they come.
std::string scene_hash(std::string_view canonical_scene, std::span<const AssetBytes> assets);

/// The content hash that names a render: equal requests of equal scenes by equal engines have
/// equal ids, whatever the image format.
std::string render_id(std::string_view canonical_request, std::string_view scene_hash,
                      std::string_view engine_version);

/// Whether `text` can be a render's id: 64 lower-case hexadecimal digits.
bool is_render_id(std::string_view text);

/// "fstop/0.1.0": part of every id and of every EXR file.
std::string_view engine_version();

}  // namespace fstop::api
