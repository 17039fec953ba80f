#include "api/sweep_manifest.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "api/json_text.h"
#include "api/json_writer.h"
#include "api/length_unit.h"
#include "api/render_id.h"
#include "core/error.h"

namespace fstop::api {
namespace {

using nlohmann::json;

constexpr std::size_t kToldMtf = 51;  // at k/100 cycles a pixel, up to the Nyquist frequency

/// Numbers different texts in the order in which they come.
class Numbering {
 public:
  // The number of `text`, and whether it is new.
  std::pair<std::size_t, bool> number(const std::string& text) {
    const auto [place, is_new] = numbers_.try_emplace(text, numbers_.size());
    return {place->second, is_new};
  }

 private:
  std::map<std::string, std::size_t> numbers_ = {};
};

/// Elements of a JSON array, as text: a sweep may have very many.
class ArrayText {
 public:
  void add(const Json& element) {
    text_ += text_.empty() ? "\n" : ",\n";
    text_ += json_text(element);
  }
  std::string member(std::string_view name) const {
    return "\"" + std::string(name) + "\":[" + text_ + "]";
  }

 private:
  std::string text_ = {};
};

std::string_view media_type_of(std::string_view name) {
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp,
                                   ImageFormat::tiff, ImageFormat::exr}) {
    if (name.ends_with("." + std::string(format_name(format)))) return media_type(format);
  }
  return "application/octet-stream";
}

// The camera of a request without what a stack varies, which is moved to `image`.
json lasting_camera(json camera, Json& image) {
  const auto move = [&](const char* part, const char* from, const char* to) {
    if (!camera.contains(part) || !camera[part].contains(from)) return;
    image[to] = camera[part][from];
    camera[part].erase(from);
  };
  move("lens", "f_number", "f_number");
  move("lens", "focus_distance_m", "focus_distance_m");
  move("pinhole", "diameter_mm", "diameter_mm");
  return camera;
}

class Manifest {
 public:
  Manifest(const SweepRequest& sweep, std::string_view id) : sweep_(sweep), id_(id) {}

  void add(std::uint32_t index, const ManifestCell& cell) {
    const json request = json::parse(sweep_.cells[index].request);
    if (!cell.problem.empty()) {
      failures_.add({{"image", index},
                     {"place", sweep_.cells[index].place},
                     {"problem", json::parse(cell.problem)},
                     {"request", request}});
      return;
    }
    Json report = Json::parse(cell.report);
    Json image = {{"id", index}, {"place", sweep_.cells[index].place}};
    const json camera = lasting_camera(request.at("camera"), image);
    const std::size_t width = request.at("image").at("width");
    const std::size_t height = request.at("image").at("height");
    const std::size_t camera_id = number_of_camera(camera, width, height);
    const std::size_t scene_id =
        number_of_scene(request.at("scene"), report.at("scene_sha256").get<std::string>());
    report.erase("scene_sha256");
    image["camera"] = camera_id;
    image["scene"] = scene_id;
    image["stack"] = stack_with(camera_id, scene_id, index);
    image["width"] = width;
    image["height"] = height;
    image["seed"] = request.at("seed");
    image["render"] = cell.render_id;
    for (const ManifestFile& file : cell.files) add_file(index, file);
    image["file"] = path_of_cell_file(index, cell.files.front().name);
    if (!cell.measurement.empty()) image["edge"] = json::parse(cell.measurement);
    image["report"] = std::move(report);
    image["request"] = request;
    images_.add(image);
  }

  std::string text() const {
    Json axes = Json::array();
    for (const SweepAxis& axis : sweep_.axes) {
      Json values = Json::array();
      for (const std::string& value : axis.values) values.push_back(Json::parse(value));
      axes.push_back({{"member", axis.member}, {"values", std::move(values)}});
    }
    ArrayText stacks;
    for (std::size_t i = 0; i < stack_list_.size(); ++i) {
      const Stack& stack = stack_list_[i];
      stacks.add(
          {{"id", i}, {"camera", stack.camera}, {"scene", stack.scene}, {"images", stack.images}});
    }
    const Json head = {{"format", "fstop-sweep/1"},
                       {"engine", engine_version()},
                       {"sweep", id_},
                       {"recipe", json::parse(sweep_.recipe)},
                       {"cells", sweep_.cells.size()},
                       {"axes", std::move(axes)}};
    std::string text = json_text(head);
    text.pop_back();  // its brace
    const std::pair<const char*, const ArrayText&> lists[] = {
        {"cameras", cameras_}, {"scenes", scenes_}, {"stacks", stacks},
        {"images", images_},   {"files", files_},   {"failures", failures_}};
    for (const auto& [name, list] : lists) {
      text += ",\n" + list.member(name);
    }
    return text + "}\n";
  }

 private:
  struct Stack {
    std::size_t camera = 0;
    std::size_t scene = 0;
    std::vector<std::uint32_t> images = {};
  };

  std::size_t number_of_camera(const json& camera, std::size_t width, std::size_t height) {
    const Json whole = {{"camera", camera}, {"width", width}, {"height", height}};
    const auto [number, is_new] = camera_numbers_.number(json_text(whole));
    if (is_new) {
      Json told = {{"id", number}};
      told.update(whole);
      cameras_.add(told);
    }
    return number;
  }

  std::size_t number_of_scene(const json& scene, const std::string& hash) {
    const auto [number, is_new] = scene_numbers_.number(hash + json_text(scene));
    if (is_new) scenes_.add({{"id", number}, {"sha256", hash}, {"scene", scene}});
    return number;
  }

  std::size_t stack_with(std::size_t camera, std::size_t scene, std::uint32_t image) {
    const auto [number, is_new] =
        stack_numbers_.number(std::to_string(camera) + ' ' + std::to_string(scene));
    if (is_new) stack_list_.push_back({.camera = camera, .scene = scene});
    stack_list_[number].images.push_back(image);
    return number;
  }

  void add_file(std::uint32_t index, const ManifestFile& file) {
    files_.add({{"id", file_count_++},
                {"image", index},
                {"name", file.name},
                {"path", path_of_cell_file(index, file.name)},
                {"media_type", media_type_of(file.name)},
                {"bytes", file.bytes},
                {"sha256", file.sha256}});
  }

  const SweepRequest& sweep_;
  std::string id_;
  Numbering camera_numbers_ = {};
  Numbering scene_numbers_ = {};
  Numbering stack_numbers_ = {};
  std::vector<Stack> stack_list_ = {};
  std::size_t file_count_ = 0;
  ArrayText cameras_ = {};
  ArrayText scenes_ = {};
  ArrayText images_ = {};
  ArrayText files_ = {};
  ArrayText failures_ = {};
};

}  // namespace

std::string sweep_manifest(const SweepRequest& sweep, std::string_view id,
                           const std::function<ManifestCell(std::uint32_t)>& cell) {
  Manifest manifest(sweep, id);
  for (std::uint32_t i = 0; i < sweep.cells.size(); ++i) manifest.add(i, cell(i));
  return manifest.text();
}

std::string path_of_cell_file(std::uint32_t index, std::string_view name) {
  char folder[32];
  std::snprintf(folder, sizeof folder, "cells/%06u/", index);
  return folder + std::string(name);
}

std::string edge_measurement(std::span<const std::byte> exr, const SlantedEdgeSpec& edge,
                             Length pixel_pitch) {
  const Picture picture = decode(exr);
  try {
    const SlantedEdge measured = measured_slanted_edge(picture.layers.front().image.view(), edge);
    const double pixels_per_mm = 1.0 / unit_of_suffix("_mm").number(pixel_pitch);
    std::vector<double> mtf = measured.mtf;
    mtf.resize(kToldMtf);
    return json_text(Json{{"mtf50_cycles_per_px", number_json(measured.mtf50)},
                          {"mtf50_cycles_per_mm", number_json(measured.mtf50 * pixels_per_mm)},
                          {"rise_10_90_px", number_json(measured.rise_10_90)},
                          {"noise", number_json(measured.noise)},
                          {"mtf", mtf}});
  } catch (const Error& error) {
    if (error.code() != ErrorCode::outside_domain) throw;
    return json_text(Json{{"not_measured", error.what()}});
  }
}

}  // namespace fstop::api
