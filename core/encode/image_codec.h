#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/film/image.h"

namespace fstop {

enum class ImageFormat { png, jpeg, webp, tiff, exr };
enum class Precision { single, half };  // of the colour samples of EXR and TIFF

/// Channels of one name stem in a file, e.g. {{"N.X", "N.Y", "N.Z"}, image}.
struct ImageLayer {
  std::vector<std::string> channel_names = {};  // as many as the image has channels
  Image image = {};
};

/// A named fact written into EXR and TIFF files. In EXR, numbers of a name that OpenEXR itself
/// defines (aperture, focus, expTime, ...) are float as it demands, others double.
struct ImageAttribute {
  std::string name = {};
  std::variant<double, int, std::string> value = {};
};

/// What goes into one file: colour first, then data layers of the same size.
struct Picture {
  std::vector<ImageLayer> layers = {};
  std::vector<ImageAttribute> attributes = {};
};

/// The file's bytes, made in memory; the same picture gives the same bytes at any time.
///
/// PNG (8 bit), JPEG (8 bit, quality 92, 4:4:4) and WebP (8 bit, lossless) hold the first layer,
/// clipped to [0,1] and sRGB-encoded; TIFF holds the first layer, linear. A first layer of four
/// channels is R, G, B and straight (not multiplied) A, which is linear everywhere and which JPEG
/// cannot hold. EXR holds every layer as it is, in ZIP
/// blocks of one part. `Precision::half` narrows the channels named R, G, B; all others (Z,
/// coc.signed, N.X, ...) stay float. TIFF keeps the attributes as `name=value` lines of its
/// ImageDescription. Non-finite samples are legal in EXR and TIFF; elsewhere +infinity becomes 1,
/// -infinity and NaN become 0.
/// Throws: Error{unsupported} for what the format cannot hold: more than 65,500 (JPEG) or 16,383
///         (WebP) pixels a side, a first layer of neither 1 nor 3 channels (PNG, JPEG, WebP), nor
///         4 (PNG, WebP);
///         Error{internal} for a picture without pixels, layers of unequal size, channel names
///         that are missing or not unique; Error{io_failure} where the encoder fails.
/// Source: IEC 61966-2-1:1999 (sRGB); OpenEXR standard attributes.
std::vector<std::byte> encode(const Picture& picture, ImageFormat format,
                              Precision precision = Precision::single);

/// Every channel of an encoded file: R, G, B (and A) or Y as the first layer, then one layer for
/// each stem before the last dot ("N" of N.X) and one for each other channel; of EXR and TIFF the
/// attributes. Values are as stored, but for colours of WebP, which come multiplied by its alpha:
/// sRGB formats give 0 to 1, not made linear. For fstop's own files; foreign ones go through
/// decode_texture, which has limits. Throws: Error{bad_image}.
Picture decode(std::span<const std::byte> bytes);

std::string_view media_type(ImageFormat format);   // "image/png", ...; EXR: "image/x-exr"
std::string_view format_name(ImageFormat format);  // "png", "jpeg", "webp", "tiff", "exr"

}  // namespace fstop
