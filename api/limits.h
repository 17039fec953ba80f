#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/scene/scene_file.h"

namespace fstop::api {

/// Every bound on what a client may ask for or hold, and on what is kept for it: one place.
struct Limits {
  // One HTTP exchange.
  std::size_t body_bytes = std::size_t{1} << 20;
  std::size_t header_bytes = std::size_t{8} << 10;
  int header_fields = 100;
  int json_depth = 32;
  std::size_t problem_bytes = std::size_t{16} << 10;  // of a problem document
  std::size_t echo_bytes = 256;                       // of input repeated in a problem
  std::size_t faults = 1000;                          // kept of one request, the rest counted

  // One image.
  int image_side = 16384;                  // pixels; the least is 1
  std::int64_t image_pixels = 67'108'864;  // 2^26
  int samples_per_pixel = 65'536;
  std::int64_t samples = 2'000'000'000;  // over all pixels of an image
  std::chrono::milliseconds render_time{600'000};
  int object_distances = 1000;  // of one optics request

  // One point spread.
  int psf_points = 4096;           // radii, and frequencies
  int psf_fractions = 64;          // of encircled energy
  int psf_image_side = 1024;       // pixels
  double psf_rgb_defocus = 700.0;  // |U| in radians: beyond, RGB needs over 513 wavelengths
  double psf_operations = 4e8;     // nodes, edges and series' terms: 15 ns each
  int waiting_psfs = 16;           // on the server; more are answered 503

  // One request for measurements in a picture.
  std::size_t measurements = 64;
  double measured_pixels = 2'097'152;                              // 2^21, over all of them
  std::size_t measured_image_pixels = std::size_t{4} * 1'048'576;  // of a picture that is sent
  int waiting_measurements = 16;  // on the server; more are answered 503

  // One composite.
  std::size_t composite_layers = 16;

  // One chart of speed against accuracy.
  std::int64_t chart_pixels = 1'048'576;       // 2^20, of each picture
  std::int64_t chart_samples = 4'000'000'000;  // over all pixels of points and reference
  std::size_t chart_counts = 32;               // of samples, for each method
  std::size_t chart_targets = 16;              // of the planner
  int chart_replicates = 64;                   // of the reference; the least is 2
  std::chrono::milliseconds chart_time{600'000};

  // One sweep.
  std::size_t sweep_cells = 10'000;
  std::size_t sweep_axes = 8;
  std::chrono::milliseconds sweep_time{std::chrono::hours(24)};  // predicted for all its cells
  std::size_t sweep_bytes = std::size_t{64} << 20;  // of its cells' requests, every default filled

  // One scene.
  AssetLimits assets{.max_file_bytes = std::size_t{64} << 20,
                     .max_triangles = 2'000'000,
                     .max_texture_pixels = 16'000'000,
                     .max_coordinate = 1e7};
  std::size_t scene_bytes = std::size_t{8} << 20;         // of a scene file's text
  std::size_t scene_file_bytes = std::size_t{256} << 20;  // over all its files
  std::size_t scene_triangles = 4'000'000;                // over all its meshes
  std::size_t scene_texture_pixels = 64'000'000;          // over all its textures
  std::size_t scene_textures = 256;
  std::size_t scene_materials = 4096;
  std::size_t scene_objects = 20'000;
  std::size_t scene_lights = 256;

  // Files by their hash, of sweeps whose cells are made elsewhere.
  std::size_t content_bytes = std::size_t{256} << 20;  // of one
  std::size_t incoming_bytes = std::size_t{1} << 30;   // being received at once, over all files

  // The server.
  int connections = 2048;
  int pipelined_answers = 8;   // queued on one connection
  int queued_renders = 256;    // more are answered 503
  int queued_per_client = 32;  // more are answered 429
  int concurrent_renders = 2;
  int express_renders = 1;                              // beside them, for small renders alone
  double small_render_s = 1.0;                          // predicted to take no longer
  std::size_t render_bytes = std::size_t{16} << 30;     // predicted for one render
  std::chrono::milliseconds synchronous_wait{2'000};    // then a render becomes a job
  std::chrono::milliseconds longest_wait{600'000};      // that a client may ask for instead
  int jobs = 1024;                                      // known at once, ended ones too
  std::chrono::milliseconds job_retention{600'000};     // of an ended one
  std::size_t kept_job_bytes = std::size_t{128} << 20;  // of results that only their jobs hold
  int idempotency_keys = 4096;
  std::chrono::milliseconds between_events{250};
  std::chrono::milliseconds event_silence{15'000};  // then a comment shows that the stream lives
  int queued_sweeps = 16;  // one leads its cells at a time; more are answered 503
  int queued_charts = 2;   // one runs, on one thread; more are answered 503
  std::size_t kept_result_bytes = std::size_t{512} << 20;  // in memory
  std::size_t kept_file_bytes = std::size_t{4} << 30;      // in the data directory
  std::size_t kept_scene_bytes = std::size_t{1} << 30;
  std::chrono::milliseconds header_deadline{10'000};  // from the first byte to the blank line
  std::chrono::milliseconds body_deadline{30'000};
  std::chrono::milliseconds write_deadline{10'000};  // for the next bytes to be taken
  std::chrono::milliseconds idle_deadline{30'000};   // between requests
  std::chrono::milliseconds drain_deadline{20'000};  // of a graceful stop
};

/// The bounds of the command line, whose user spends only his own time and memory.
inline Limits command_line_limits() {
  Limits limits;
  limits.samples = 1'000'000'000'000;
  limits.psf_operations = 1e11;
  limits.chart_pixels = limits.image_pixels;
  limits.chart_samples = limits.samples;
  limits.body_bytes = limits.scene_bytes;
  limits.sweep_cells = 100'000;
  limits.sweep_bytes = std::size_t{1} << 30;
  return limits;
}

}  // namespace fstop::api
