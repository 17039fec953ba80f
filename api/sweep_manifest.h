#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/sweep_request.h"

namespace fstop::api {

/// A file of a cell.
struct ManifestFile {
  std::string name = {};  // within the cell: "image.exr"
  std::string sha256 = {};
  std::uint64_t bytes = 0;
};

/// What became of a cell.
struct ManifestCell {
  std::string render_id = {};
  std::vector<ManifestFile> files = {};
  std::string report = {};       // JSON (lasting_report_json)
  std::string problem = {};      // JSON, of a cell that failed; then nothing else
  std::string measurement = {};  // JSON, where the sweep measures
};

/// The manifest of a finished sweep, `SweepManifest` in openapi.json: cameras, scenes, stacks,
/// images, files and failures that refer to each other by `id`. Holds no time: equal sweeps have
/// equal manifests. Cameras are told without focus and aperture, which images have: a stack is the
/// images of one scene through one camera. `cell`: what became of cell i, asked once for each in
/// order. Ends in a line feed.
std::string sweep_manifest(const SweepRequest& sweep, std::string_view id,
                           const std::function<ManifestCell(std::uint32_t)>& cell);

/// "cells/000012/image.exr": where a manifest says that a cell's file lies.
std::string path_of_cell_file(std::uint32_t index, std::string_view name);

/// The slanted edge of an EXR picture as the sweep's manifest tells it: mtf50, rise and the MTF, or
/// why it cannot be measured. `pixel_pitch`: on the sensor. Throws: Error{bad_image}.
std::string edge_measurement(std::span<const std::byte> exr, const SlantedEdgeSpec& edge,
                             Length pixel_pitch);

}  // namespace fstop::api
