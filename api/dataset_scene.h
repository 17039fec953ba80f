#pragma once

#include <cstdint>

#include <nlohmann/json.hpp>

namespace fstop::api {

/// Which image of a data set.
struct DatasetPlace {
  std::uint32_t seed = 0;
  std::uint32_t image = 0;
  std::uint32_t images_per_scene = 1;  // that share scene, camera and lens, not focus and aperture
};

/// The render request of one image of an endless data set: `base` (image, quality, effects,
/// outputs) with a scene and a camera at random. Bundled meshes and spheres, in bundled textures,
/// are scattered through the field of view between 0.6 and 6 m before a wall and over a floor,
/// under a sun and one or two lamps. Focal lengths are 24 to 85 mm, f-numbers 2^(n/6) from 1.41 to
/// 16, focus distances 0.6 to 8 m of equal chance per ratio; half of the scenes are seen by a lens
/// that breathes. Absent members of `base` become: 384 x 256 pixels, EXR, every
/// output but the normal. The same place gives the same request on every machine.
nlohmann::json dataset_request(const nlohmann::json& base, const DatasetPlace& place);

}  // namespace fstop::api
