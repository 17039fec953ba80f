#pragma once

#include <string>
#include <string_view>

namespace fstop {

/// Bounds what the glTF library can be made to do by the file's JSON text, before it sees it: the
/// library copies JSON with one call for each level, makes up to 3 kB of each object and, in a
/// .glb, copies the binary chunk for each buffer. Malformed JSON passes: the library refuses it.
/// Throws: Error{bad_geometry} for more than 64 levels or 200,000 commas and opening brackets, for
///         a second buffer of a .glb, and for a .glb too short to hold its JSON.
void check_gltf_outline(const std::string& name, std::string_view file, bool binary);

}  // namespace fstop
