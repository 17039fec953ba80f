#include "api/finishing_json.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace fstop::api {
namespace {

constexpr Named<HalftoneMethod> kHalftones[] = {
    {"clustered-dot", HalftoneMethod::clustered_dot},
    {"dispersed-dot", HalftoneMethod::dispersed_dot},
    {"varying-dot", HalftoneMethod::varying_dot},
    {"error-diffusion", HalftoneMethod::error_diffusion}};
// Whether every pixel becomes a cell of its own.
constexpr Named<bool> kCells[] = {{"tiled", false}, {"per-pixel", true}};

bool is_ordered(HalftoneMethod method) {
  return method == HalftoneMethod::clustered_dot || method == HalftoneMethod::dispersed_dot;
}

// Members of one method alone are faults with others, and have no part in their normal form.
void read_screen(ObjectReader& halftone, HalftoneSpec& spec) {
  const bool has_dots = spec.method != HalftoneMethod::error_diffusion;
  const auto belongs = [&](const char* key, bool is_legal, const char* to) {
    if (is_legal) return true;
    if (halftone.value(key, false) != nullptr) {
      halftone.fault(key, std::string("needs method to be ") + to);
    }
    return false;
  };
  if (belongs("cell_px", has_dots, "clustered-dot, dispersed-dot or varying-dot")) {
    spec.cell = halftone.number("cell_px", {2.0, kLargestCell}, 4.0);
    const bool is_whole = spec.cell == std::floor(spec.cell);
    if (is_ordered(spec.method) && !is_whole) {
      halftone.fault("cell_px", "must be a whole number of pixels where dots have cells");
    } else if (spec.method == HalftoneMethod::dispersed_dot &&
               !has_dispersed_order(static_cast<int>(spec.cell))) {
      halftone.fault("cell_px", "must be 2, 3, 4, 6, 8, 12 or 16 pixels where dots are dispersed");
    }
  }
  if (belongs("angle_deg", spec.method == HalftoneMethod::varying_dot, "varying-dot")) {
    spec.angle = halftone.number("angle_deg", {-360.0, 360.0}, 45.0) * (std::numbers::pi / 180.0);
  }
  if (belongs("symmetric", spec.method == HalftoneMethod::clustered_dot, "clustered-dot")) {
    spec.symmetric = halftone.boolean("symmetric", false);
  }
  if (belongs("cells", is_ordered(spec.method), "clustered-dot or dispersed-dot")) {
    spec.patterns = halftone.choice<bool>("cells", kCells, "tiled");
  }
}

}  // namespace

std::optional<HalftoneSpec> read_halftone(ObjectReader& image, int width, int height,
                                          const Limits& limits) {
  const nlohmann::json* member = image.value("halftone", false);
  if (member == nullptr || member->is_null()) {
    image.leave_out("halftone");
    return {};
  }
  ObjectReader halftone = image.object("halftone");
  HalftoneSpec spec;
  spec.method = halftone.choice<HalftoneMethod>("method", kHalftones, "clustered-dot");
  read_screen(halftone, spec);
  spec.levels = static_cast<int>(halftone.integer("levels", 2, 256, 2));
  spec.gray = halftone.boolean("gray", false);
  const double scale = spec.patterns ? spec.cell : 1.0;
  const double side = scale * std::max(width, height);
  const double pixels = scale * scale * width * height;
  if (halftone.clean() &&
      (side > limits.image_side || pixels > static_cast<double>(limits.image_pixels))) {
    halftone.fault("cells", "cannot be per-pixel: the picture would have " +
                                std::to_string(static_cast<std::int64_t>(pixels)) +
                                " pixels, at most " + std::to_string(limits.image_side) +
                                " a side and " + std::to_string(limits.image_pixels) +
                                " in all are allowed");
  }
  halftone.reject_unread_members();
  return spec;
}

}  // namespace fstop::api
