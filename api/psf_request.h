#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"
#include "core/camera/camera_spec.h"
#include "core/encode/image_codec.h"
#include "core/parallel.h"
#include "core/post/point_spread_image.h"

namespace fstop::api {

/// How an 8-bit picture shows a density of which the brightest pixel is 1.
enum class PsfStretch {
  linear,       ///< p
  square_root,  ///< sqrt(p)
  asinh,        ///< asinh(1000 p)/asinh(1000)
  log           ///< 1 + log10(p)/4, four decades
};

/// The image that is asked for; absent members are filled from the optics.
struct PsfImageSpec {
  PointSpreadRaster raster = {};
  ImageFormat format = ImageFormat::png;
  PsfStretch stretch = PsfStretch::asinh;
};

/// A request for a point spread: every value checked, every default filled.
struct PsfRequest {
  PointSpreadSpec spec = {};
  Length object_distance = {};
  std::vector<Length> radii = {};
  /// Cycles/m; absent: evenly up to the cut-off.
  std::optional<std::vector<double>> frequencies = {};
  std::vector<double> fractions = {};
  bool has_image = false;  // the request has the member
  PsfImageSpec image = {};
};

/// A point's image as a file's content, and what was done to it.
struct PsfPicture {
  Picture picture = {};
  std::string stretch = {};  // for people: what a pixel's linear value is
};

/// Reads {"camera", "object_distance_m", "wavelength_nm", "spectrum", "field_angle_deg",
/// "radii_um", "frequencies_per_mm", "fractions", "image"}; all but the camera may be absent.
/// Throws: InvalidRequest with every fault.
PsfRequest parse_psf_request(std::string_view body, const Limits& limits);

/// Profile, OTF, encircled energy, regime and error bound as JSON text; with the member "image"
/// also what the image holds. Throws: InvalidRequest{over_budget} with the pointer of what asks for
/// too much work; Error with
///         the reason where no model of core/optics holds.
std::string psf_json(const PsfRequest& request, const Limits& limits, const RunControl& run);

/// The image: linear density in 1/mm^2 for EXR and TIFF, else stretched.
/// Throws: as psf_json.
PsfPicture psf_picture(const PsfRequest& request, ImageFormat format, const Limits& limits,
                       const RunControl& run);

}  // namespace fstop::api
