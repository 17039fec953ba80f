#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>
#include <zlib.h>

namespace fstop::test {

/// One file of an archive; what differs from the defaults makes it a wrong one.
struct ZipFile {
  std::string name = {};
  std::string content = {};
  std::uint32_t mode = 0100644;  // of Unix: kind and rights
  std::uint32_t flags = 0;
  int method = 8;  // deflated
  std::uint32_t checksum_error = 0;
  std::uint32_t size_error = 0;
  std::string local_name = {};  // in its own header, if another than in the directory
};

inline void put(std::string& text, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xFFU);
}

inline std::string deflated(std::string_view text) {
  z_stream stream = {};
  deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, static_cast<uLong>(text.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// A zip archive of `files` (PKWARE APPNOTE 6.3), written from the format, not by the reader's
/// code.
inline std::string zip_of(const std::vector<ZipFile>& files) {
  std::string zip;
  std::string directory;
  for (const ZipFile& file : files) {
    const std::string packed = file.method == 8 ? deflated(file.content) : file.content;
    const auto* bytes = reinterpret_cast<const Bytef*>(file.content.data());
    const auto checksum =
        static_cast<std::uint32_t>(crc32_z(0, bytes, file.content.size())) ^ file.checksum_error;
    const std::string local = file.local_name.empty() ? file.name : file.local_name;
    std::string facts;  // what both headers say
    put(facts, 20, 2);
    put(facts, file.flags, 2);
    put(facts, static_cast<std::uint64_t>(file.method), 2);
    put(facts, 0, 4);  // time
    put(facts, checksum, 4);
    put(facts, packed.size(), 4);
    put(facts, file.content.size() + file.size_error, 4);
    put(directory, 0x02014b50, 4);
    put(directory, 0x0314, 2);  // made by Unix
    directory += facts;
    put(directory, file.name.size(), 2);
    put(directory, 0, 8);  // no extra field, no comment, first disk
    put(directory, std::uint64_t{file.mode} << 16U, 4);
    put(directory, zip.size(), 4);
    directory += file.name;
    put(zip, 0x04034b50, 4);
    zip += facts;
    put(zip, local.size(), 2);
    put(zip, 0, 2);
    zip += local + packed;
  }
  std::string end;
  put(end, 0x06054b50, 4);
  put(end, 0, 4);
  put(end, files.size(), 2);
  put(end, files.size(), 2);
  put(end, directory.size(), 4);
  put(end, zip.size(), 4);
  put(end, 0, 2);
  return zip + directory + end;
}

/// A .glb of one triangle, a coloured material, a camera whose view is 2 atan(1/2) high, one metre
/// before its parent that is 5 m along z, and a point light at (1, 2, 3).
inline std::string small_glb() {
  std::string json = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 3]}],
      "extensionsUsed": ["KHR_lights_punctual"],
      "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 10}]}},
      "nodes": [{"mesh": 0}, {"translation": [0, 0, 5], "children": [2]},
                {"camera": 0, "translation": [0, 0, 1]},
                {"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
      "cameras": [{"type": "perspective",
                   "perspective": {"yfov": 0.92729521800161223, "znear": 0.1, "aspectRatio": 1.5}}],
      "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 1]}}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                     "min": [0, 0, 0], "max": [1, 1, 0]}],
      "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36}]})";
  while (json.size() % 4 != 0) json += ' ';
  std::string bin;
  for (const std::uint32_t bits :
       {0x0U, 0x0U, 0x0U, 0x3f800000U, 0x0U, 0x0U, 0x0U, 0x3f800000U, 0x0U})
    put(bin, bits, 4);
  std::string glb = "glTF";
  put(glb, 2, 4);
  put(glb, 12 + 8 + json.size() + 8 + bin.size(), 4);
  put(glb, json.size(), 4);
  put(glb, 0x4E4F534A, 4);
  glb += json;
  put(glb, bin.size(), 4);
  put(glb, 0x004E4942, 4);
  return glb + bin;
}

}  // namespace fstop::test
