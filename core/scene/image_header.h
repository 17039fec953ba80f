#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace fstop {

enum class TextureFormat { png, jpeg, exr };

/// What the first bytes of an image file promise, read without a decoder.
struct ImageHeader {
  TextureFormat format = TextureFormat::png;
  int width = 0;  // pixels, > 0
  int height = 0;
};

/// Recognises PNG, JPEG and EXR by their first bytes and checks as much of their structure as
/// bounds a decoder's work and memory: sizes, PNG's chunks and their checksums, EXR's attributes.
/// Throws: Error{bad_image} naming the file: of another kind, truncated, multi-part or deep EXR,
///         more than `max_pixels` pixels or 65,536 a side, EXR blocks of more than 2^28 bytes.
/// Source: PNG (W3C 2003) 5, 11; JPEG (ITU T.81) B; OpenEXR File Layout.
ImageHeader image_header(const std::string& name, std::span<const std::byte> bytes,
                         std::size_t max_pixels);

/// The same file without the parts that hold no pixels (PNG text, profile and time, JPEG Exif, XMP
/// and comments): decoders parse and keep those though nobody asked. `header` is that of `bytes`;
/// EXR comes back as it is.
std::vector<std::byte> without_metadata(const ImageHeader& header,
                                        std::span<const std::byte> bytes);

/// Throws: Error{bad_image} "`name`: `reason`".
[[noreturn]] void refuse_image(const std::string& name, const std::string& reason);

}  // namespace fstop
