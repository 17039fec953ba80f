#include "tests/http/test_server.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <stdlib.h>
#include <utility>

#include "core/error.h"

namespace fstop::test {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "fstop-http-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void TemporaryFolder::write(const std::string& name, std::string_view content) const {
  fs::create_directories((path_ / name).parent_path());
  std::ofstream(path_ / name, std::ios::binary) << content;
}

int TemporaryFolder::files() const {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path_))
    count += entry.is_regular_file();
  return count;
}

std::string text_of_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_scenes(const TemporaryFolder& folder) {
  folder.write("scenes/tiny/scene.json", R"({
    "format": "fstop-scene/1",
    "title": "Tiny",
    "description": "A ball before a wall.",
    "materials": {
      "wall": {"model": "unlit", "emission": [0.2, 0.4, 0.6]},
      "ball": {"model": "phong", "ambient": [0.1, 0.1, 0.1], "diffuse": [0.8, 0.3, 0.2],
               "specular": [0.5, 0.5, 0.5], "shininess": 40}
    },
    "objects": [
      {"type": "quad", "corner_m": [-4, -4, -6], "edge_u_m": [8, 0, 0], "edge_v_m": [0, 8, 0],
       "material": "wall"},
      {"type": "sphere", "center_m": [0, 0, -2], "radius_m": 0.3, "material": "ball"}
    ],
    "lights": [{"type": "directional", "direction": [-1, -1, -1], "intensity": [1, 1, 1]}],
    "ambient_light": [0.2, 0.2, 0.2]
  })");
  folder.write("scenes/broken-mesh/scene.json", R"({
    "format": "fstop-scene/1",
    "materials": {"m": {"model": "unlit", "emission": [1, 1, 1]}},
    "objects": [{"type": "mesh", "file": "cut.ply", "material": "m"}]
  })");
  folder.write("scenes/broken-mesh/cut.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
               "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
               "end_header\n0 0 -1\n1 0 -1\n");
  folder.write("scenes/no-texture/scene.json", R"({
    "format": "fstop-scene/1",
    "textures": {"card": {"file": "gone.png"}},
    "materials": {"m": {"model": "unlit", "emission": {"texture": "card"}}},
    "objects": [{"type": "sphere", "center_m": [0, 0, -2], "radius_m": 1, "material": "m"}]
  })");
}

std::string tiny_request(int seed, const std::string& members) {
  return R"({"scene": "tiny", "camera": {"lens": {"focal_length_mm": 50, "f_number": 2,
             "focus_distance_m": 2}}, "image": {"width": 48, "height": 32},
             "quality": {"samples": 16}, "seed": )" +
         std::to_string(seed) + members + "}";
}

TestServer::TestServer(Options options) {
  write_scenes(folder_);
  folder_.write("web/index.html", "<!doctype html><title>page</title>\n");
  folder_.write("web/assets/page-1a2b3c.js", "export {};\n");
  folder_.write("web/.hidden", "no\n");
  folder_.write("secret", "no\n");
  fs::create_symlink("../secret", folder_.path() / "web/link");
  log_ = std::make_unique<server::Log>((folder_.path() / "log").string());
  const server::ServerConfig config{
      .address = options.address,
      .port = 0,
      .threads = options.threads,
      .token = options.token,
      .url_key = options.url_key,
      .hosts = options.hosts,
      .origins = options.origins,
      .probe_port = 0,
      .upload_folder = options.takes_scenes ? folder_.path() / "uploads" : fs::path(),
      .program = FSTOP_PROGRAM,
      .worker_program = FSTOP_WORKER,
      .result_folder = options.result_folder,
      .job_folder = options.job_folder,
      .sweep_folder = options.data_folder.empty() ? fs::path() : options.data_folder / "sweeps",
      .file_folder = options.data_folder.empty() ? fs::path() : options.data_folder / "files",
      .web_root = (folder_.path() / "web").string(),
      .scene_folders = {folder_.path() / "uploads", folder_.path() / "scenes"},
      .limits = options.limits};
  server_ = std::make_unique<server::Server>(config, *log_, std::move(options.simulate));
  thread_ = std::thread([this] {
    server_->run();
    ended_ = true;
  });
}

TestServer::~TestServer() {
  server_->stop();
  thread_.join();
}

bool TestServer::ends_within(std::chrono::milliseconds patience) {
  return eventually([this] { return ended_.load(); }, patience);
}

server::Simulate HeldRenders::simulate() {
  return [this](const SimulationSpec& spec, const RayScene&, const RunControl& run) {
    ++begun_;
    ++running_;
    if (run.progress) run.progress(0.25);
    if (run.preview) {
      Image picture(spec.width, spec.height, 3);
      std::fill(picture.pixels().begin(), picture.pixels().end(), 0.5F);
      run.preview(picture, 0.125);
    }
    {
      std::unique_lock lock(mutex_);
      // A stop comes without a notice of ours: look often.
      while (!is_open_ && !run.stop.stop_requested())
        changed_.wait_for(lock, std::chrono::milliseconds(1));
    }
    --running_;
    if (run.stop.stop_requested()) {
      ++stopped_;
      throw Error(ErrorCode::cancelled, "stopped before it was done");
    }
    Photograph photograph;
    photograph.color = Image(spec.width, spec.height, 3);
    photograph.layers[Output::depth] = Image(spec.width, spec.height, 1);
    photograph.layers[Output::coc] = Image(spec.width, spec.height, 1);
    photograph.report.method = "held";
    return photograph;
  };
}

void HeldRenders::let_go() {
  {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
  }
  changed_.notify_all();
}

bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace fstop::test
