#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

#include "api/render_request.h"
#include "api/scene_assets.h"
#include "server/memory_file.h"

namespace fstop::server {

/// One photograph that a worker process is to make of the scene that comes with it.
struct WorkerJob {
  SimulationSpec spec = {};
  std::string scene_hash = {};
  bool wants_previews = false;
};

/// A photograph that a worker has made.
struct WorkerResult {
  Photograph photograph = {};
  double cpu_ms = 0.0;    // processor time of the light path
  double build_ms = 0.0;  // processor time of building the scene before it; 0: it was there
};

std::string job_bytes(const WorkerJob& job);
WorkerJob job_of(std::string_view bytes);

MemoryFile result_file(const WorkerResult& result);
/// Throws: Error{internal} where it holds none, Error{io_failure}.
WorkerResult result_of(const MemoryFile& file);

/// A scene with its assets, to be built by whoever reads it.
MemoryFile scene_file(const Scene& scene);
/// Throws: as result_of.
Scene scene_of(const MemoryFile& file);

MemoryFile image_file(const Image& image);
Image image_of(const MemoryFile& file);

/// A number as the body of a message.
std::string number_bytes(double number);
double number_of(std::string_view bytes);

/// What was thrown, for the other process to throw it again: Error and std::bad_alloc as they are,
/// all else as Error{internal}.
std::string failure_bytes(const std::exception& exception);
[[noreturn]] void throw_failure(std::string_view bytes);

}  // namespace fstop::server
