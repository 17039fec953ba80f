#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/optics_request.h"
#include "api/picture.h"
#include "api/psf_request.h"
#include "api/render_id.h"
#include "api/render_request.h"
#include "api/report_json.h"
#include "api/scene_store.h"
#include "core/parallel.h"
#include "server/commands.h"
#include "server/cpu_meter.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

}  // namespace

std::optional<ImageFormat> format_of_name(const fs::path& file) {
  constexpr std::pair<std::string_view, ImageFormat> kExtensions[] = {
      {".png", ImageFormat::png},   {".jpeg", ImageFormat::jpeg}, {".jpg", ImageFormat::jpeg},
      {".webp", ImageFormat::webp}, {".tiff", ImageFormat::tiff}, {".tif", ImageFormat::tiff},
      {".exr", ImageFormat::exr}};
  for (const auto& [extension, format] : kExtensions) {
    if (file.extension() == extension) return format;
  }
  if (!file.extension().empty()) {
    throw Error(
        ErrorCode::unsupported,
        "--out must end in .png, .jpg, .webp, .tif or .exr, not in " + file.extension().string());
  }
  return std::nullopt;
}

void write_image(const std::string& file, const std::vector<std::byte>& bytes) {
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void print_line(const std::string& text) {
  std::cout << text << '\n' << std::flush;
  if (!std::cout) throw Error(ErrorCode::io_failure, "cannot write to standard output");
}

int render(const RenderOptions& options) {
  const api::Limits limits = api::command_line_limits();
  const auto request = api::parse_render_request(text_of(options.request, limits.body_bytes),
                                                 limits, api::SceneNames::stored_or_files);
  const ImageFormat format = format_of_name(options.out).value_or(request.format);
  if (format == ImageFormat::jpeg && std::ranges::count(request.spec.outputs, Output::alpha) > 0) {
    throw Error(ErrorCode::unsupported, "jpeg holds no alpha: --out must end in another suffix");
  }
  const fs::path folder =
      options.request == "-" ? fs::path(".") : fs::absolute(options.request).parent_path();
  const api::SceneStore store(
      {options.scenes_dir.empty() ? bundled_scenes() : fs::path(options.scenes_dir)}, limits);
  const auto start = std::chrono::steady_clock::now();
  CpuMeter cpu;
  const double cpu_start = cpu.start();
  api::LoadedScene loaded = api::load_beside(request, folder, store, limits);
  const std::string id = api::render_id(request.canonical, loaded.hash, api::engine_version());
  const RayScene scene(std::move(loaded.scene));
  SimulationSpec spec = request.spec;
  spec.outputs = api::layers_needed(format, spec.outputs);
  WorkerPool pool(options.threads);
  const Photograph photograph = simulate(spec, scene, {.workers = &pool});
  api::Timing timing{.render_ms = milliseconds_since(start), .cpu_ms = cpu.stop(cpu_start)};

  const auto encode_start = std::chrono::steady_clock::now();
  const auto bytes =
      encode(api::picture_of(photograph, request.spec, id, format), format, request.precision);
  timing.encode_ms = milliseconds_since(encode_start);
  write_image(options.out, bytes);
  const std::string report = api::report_json(id, photograph.report, timing, request.normalised);
  if (options.report.empty()) {
    print_line(report);
  } else {
    write_file(options.report, report + "\n");
  }
  return 0;
}

int psf(const PsfOptions& options) {
  const api::Limits limits = api::command_line_limits();
  api::PsfRequest request =
      api::parse_psf_request(text_of(options.request, limits.body_bytes), limits);
  WorkerPool pool(0);
  const RunControl run{.workers = &pool};
  // What goes into a file is told in the numbers as well.
  request.has_image = request.has_image || !options.out.empty();
  const std::string numbers = api::psf_json(request, limits, run);
  if (!options.out.empty()) {
    const ImageFormat format = format_of_name(options.out).value_or(request.image.format);
    write_image(options.out,
                encode(api::psf_picture(request, format, limits, run).picture, format));
  }
  print_line(numbers);
  return 0;
}

int optics(const std::string& request) {
  const api::Limits limits = api::command_line_limits();
  print_line(
      api::optics_json(api::parse_optics_request(text_of(request, limits.body_bytes), limits)));
  return 0;
}

}  // namespace fstop::server
