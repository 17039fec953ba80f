#include <algorithm>
#include <cmath>
#include <numbers>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/length_unit.h"
#include "api/problem.h"
#include "api/psf_request.h"
#include "api/render_id.h"
#include "core/post/point_spread_energy.h"

namespace fstop::api {
namespace {

constexpr int kDefaultFrequencies = 65;

double per_millimetre(double per_metre) { return per_metre / unit_of_suffix("_mm").per_metre; }

// 1/m^2 as 1/mm^2.
double per_square_millimetre(double per_square_metre) {
  return per_millimetre(per_millimetre(per_square_metre));
}

[[noreturn]] void over_budget(std::string pointer, std::string detail) {
  throw InvalidRequest(FieldFault{std::move(pointer), std::move(detail)}, ErrorCode::over_budget);
}

void require_work(double operations, std::string_view pointer, const Limits& limits) {
  if (operations <= limits.psf_operations) return;
  over_budget(std::string(pointer), "asks for about " + number_text(std::round(operations)) +
                                        " operations; at most " +
                                        number_text(limits.psf_operations) + " are allowed");
}

PointSpread spread_of(const PsfRequest& request, const Limits& limits) {
  const PointSpreadSpec& spec = request.spec;
  const double radius = spec.pupil.diameter.si() / 2.0;
  const double defocus = 2.0 * std::numbers::pi * radius / spec.wavelength.si() * radius *
                         std::abs(spec.pupil.defocus.si());
  if (spec.rgb && !(defocus <= limits.psf_rgb_defocus)) {
    over_budget("#/spectrum", "can be rgb only while the defocus |U| is at most " +
                                  number_text(limits.psf_rgb_defocus) + " rad; it is " +
                                  number_text(defocus));
  }
  Length largest = {};
  for (const Length r : request.radii) largest = std::max(largest, r);
  return PointSpread(spec, largest);
}

// One number, or three of RGB.
template <typename ValueOf>
Json channels_json(const PointSpread& spread, ValueOf&& value_of) {
  if (spread.channels() == 1) return number_json(value_of(std::size_t{0}));
  Json list = Json::array();
  for (std::size_t c = 0; c < 3; ++c) list.push_back(number_json(value_of(c)));
  return list;
}

Json profile_json(const PsfRequest& request, const PointSpread& spread) {
  std::vector<double> radii;
  for (const Length radius : request.radii) radii.push_back(radius.si());
  std::vector<Channels> along_x(radii.size());
  spread.densities(radii, along_x);
  Json list = Json::array();
  for (std::size_t i = 0; i < radii.size(); ++i) {
    Json& item = list.emplace_back(Json::object());
    put_length(item, "radius_um", request.radii[i]);
    item["psf_per_mm2"] =
        channels_json(spread, [&](std::size_t c) { return per_square_millimetre(along_x[i][c]); });
    if (spread.is_round()) continue;
    const Channels along_y = spread.density({0.0, radii[i]});
    item["psf_y_per_mm2"] =
        channels_json(spread, [&](std::size_t c) { return per_square_millimetre(along_y[c]); });
  }
  return list;
}

std::vector<double> frequencies_of(const PsfRequest& request, const PointSpread& spread) {
  if (request.frequencies) return *request.frequencies;
  std::vector<double> frequencies;
  for (int i = 0; i < kDefaultFrequencies; ++i) {
    frequencies.push_back(spread.cut_off() * (static_cast<double>(i) / (kDefaultFrequencies - 1)));
  }
  return frequencies;
}

void put_otf(Json& item, const PointSpread& spread, const std::string& name, Vec2 frequency) {
  const auto otf = spread.otf(frequency);
  item[name] = channels_json(spread, [&](std::size_t c) { return otf[c].real(); });
  if (!spread.has_phase()) return;
  item[name + "_imaginary"] = channels_json(spread, [&](std::size_t c) { return otf[c].imag(); });
}

Json otf_json(const PointSpread& spread, const std::vector<double>& frequencies) {
  Json list = Json::array();
  for (const double frequency : frequencies) {
    Json& item =
        list.emplace_back(Json{{"frequency_per_mm", number_json(per_millimetre(frequency))}});
    put_otf(item, spread, "otf", {frequency, 0.0});
    if (!spread.is_round()) put_otf(item, spread, "otf_y", {0.0, frequency});
  }
  return list;
}

Json energy_json(const PsfRequest& request, const PointSpread& spread) {
  const std::vector<Channels> radii = encircled_radii(spread, request.fractions);
  Json list = Json::array();
  for (std::size_t i = 0; i < radii.size(); ++i) {
    list.push_back({{"fraction", number_json(request.fractions[i])},
                    {"radius_um", channels_json(spread, [&](std::size_t c) {
                       return unit_of_suffix("_um").number(Length::si(radii[i][c]));
                     })}});
  }
  return list;
}

std::string_view name_of(PsfStretch stretch) {
  switch (stretch) {
    case PsfStretch::linear:
      return "linear";
    case PsfStretch::square_root:
      return "square-root";
    case PsfStretch::asinh:
      return "asinh";
    case PsfStretch::log:
      return "log";
  }
  return "";
}

std::string_view formula_of(PsfStretch stretch) {
  switch (stretch) {
    case PsfStretch::linear:
      return "p";
    case PsfStretch::square_root:
      return "sqrt(p)";
    case PsfStretch::asinh:
      return "asinh(1000 p)/asinh(1000)";
    case PsfStretch::log:
      return "max(0, 1 + log10(p)/4)";
  }
  return "";
}

double stretched(PsfStretch stretch, double p) {
  switch (stretch) {
    case PsfStretch::linear:
      return p;
    case PsfStretch::square_root:
      return std::sqrt(std::max(p, 0.0));
    case PsfStretch::asinh:
      return std::asinh(1000.0 * p) / std::asinh(1000.0);
    case PsfStretch::log:
      return p > 0.0 ? std::max(0.0, 1.0 + std::log10(p) / 4.0) : 0.0;
  }
  return 0.0;
}

double peak_of(const Image& image) {
  return static_cast<double>(*std::ranges::max_element(image.pixels()));
}

Json image_json(const PsfRequest& request, const PointSpread& spread, const RunControl& run) {
  const PointSpreadImage image = point_spread_image(spread, request.image.raster, run);
  Json value = {{"width", request.image.raster.width}, {"height", request.image.raster.height}};
  put_length(value, "pixel_um", request.image.raster.pitch);
  value["stretch"] = name_of(request.image.stretch);
  value["stretch_formula"] = formula_of(request.image.stretch);
  value["peak_per_mm2"] = number_json(per_square_millimetre(peak_of(image.density)));
  value["energy"] = channels_json(spread, [&](std::size_t c) { return image.energy[c]; });
  return value;
}

std::vector<std::string> warnings_of(const PsfRequest& request) {
  std::vector<std::string> warnings;
  if (request.spec.pupil.has_lens && request.spec.field_angle != 0.0) {
    warnings.emplace_back(
        "the ideal thin lens images every point alike: field_angle_deg changes nothing");
  }
  return warnings;
}

double profile_cost(const PsfRequest& request, const PointSpread& spread) {
  double cost = 0.0;
  for (const Length radius : request.radii) cost += spread.density_cost(radius.si());
  return spread.is_round() ? cost : 2.0 * cost;
}

std::vector<ImageAttribute> attributes_of(const PsfRequest& request, const PointSpread& spread,
                                          const PointSpreadImage& image) {
  const PointSpreadSpec& spec = request.spec;
  const auto number = [](std::string_view unit, Length length) {
    return unit_of_suffix(unit).number(length);
  };
  std::vector<ImageAttribute> attributes = {
      {"fstop:quantity", std::string("point spread, 1/mm^2, mean over the pixel")},
      {"fstop:engine", std::string(engine_version())},
      {"fstop:pixelUm", number("_um", request.image.raster.pitch)},
      {"fstop:wavelengthNm", number("_nm", spec.wavelength)},
      {"fstop:spectrum", std::string(spec.rgb ? "rgb" : "monochromatic")},
      {"fstop:objectDistanceM", number("_m", request.object_distance)},
      {"fstop:fieldAngleDeg", spec.field_angle * (180.0 / std::numbers::pi)},
      {"fstop:fresnelNumber", spread.fresnel_number()},
      {"fstop:errorBound", spread.error_bound()}};
  for (std::size_t c = 0; c < static_cast<std::size_t>(spread.channels()); ++c) {
    attributes.push_back({std::string("fstop:energy") + "RGB"[c], image.energy[c]});
  }
  return attributes;
}

}  // namespace

std::string psf_json(const PsfRequest& request, const Limits& limits, const RunControl& run) {
  const PointSpread spread = spread_of(request, limits);
  const std::vector<double> frequencies = frequencies_of(request, spread);
  require_work(profile_cost(request, spread), "#/radii_um", limits);
  const double axes = spread.is_round() ? 1.0 : 2.0;
  require_work(axes * static_cast<double>(frequencies.size()) * spread.otf_cost(),
               "#/frequencies_per_mm", limits);
  if (!request.fractions.empty()) {
    require_work(encircled_radii_cost(spread, request.fractions.size()), "#/fractions", limits);
  }
  if (request.has_image) {
    require_work(point_spread_image_cost(spread, request.image.raster), "#/image", limits);
  }
  Json answer = Json::object();
  answer["spectrum"] = request.spec.rgb ? "rgb" : "monochromatic";
  put_length(answer, "wavelength_nm", request.spec.wavelength);
  put_length(answer, "object_distance_m", request.object_distance);
  answer["profile"] = profile_json(request, spread);
  answer["otf"] = otf_json(spread, frequencies);
  answer["encircled_energy"] = energy_json(request, spread);
  answer["fresnel_number"] = number_json(spread.fresnel_number());
  answer["regime"] = fstop::name_of(spread.regime());
  answer["error_bound"] = number_json(spread.error_bound());
  answer["error"] = {{"model", number_json(spread.model_error())},
                     {"spectral", number_json(spread.spectral_error())}};
  answer["wavelengths"] = spread.wavelengths();
  put_length(answer, "airy_diameter_um", 2.0 * airy_radius(request.spec));
  put_length(answer, "geometric_diameter_um", 2.0 * geometric_radius(request.spec));
  answer["cut_off_per_mm"] = number_json(per_millimetre(spread.cut_off()));
  if (request.has_image) answer["image"] = image_json(request, spread, run);
  answer["warnings"] = warnings_of(request);
  return json_text(answer);
}

PsfPicture psf_picture(const PsfRequest& request, ImageFormat format, const Limits& limits,
                       const RunControl& run) {
  const PointSpread spread = spread_of(request, limits);
  require_work(point_spread_image_cost(spread, request.image.raster), "#/image", limits);
  PointSpreadImage made = point_spread_image(spread, request.image.raster, run);
  const bool is_linear = format == ImageFormat::exr || format == ImageFormat::tiff;
  const double peak = peak_of(made.density);
  for (float& pixel : made.density.pixels()) {
    const double density = pixel;
    pixel = static_cast<float>(is_linear ? per_square_millimetre(density)
                                         : stretched(request.image.stretch, density / peak));
  }
  PsfPicture result;
  result.picture.attributes = attributes_of(request, spread, made);
  std::vector<std::string> names = {"Y"};
  if (spread.channels() == 3) names = {"R", "G", "B"};
  result.picture.layers.push_back({std::move(names), std::move(made.density)});
  result.stretch = is_linear
                       ? "none; density in 1/mm^2"
                       : std::string(name_of(request.image.stretch)) + "; " +
                             std::string(formula_of(request.image.stretch)) + ", p = density/(" +
                             number_text(per_square_millimetre(peak)) + " per mm^2), sRGB-encoded";
  return result;
}

}  // namespace fstop::api
