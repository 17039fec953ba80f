#include "core/render/shot_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/render/emitter_choice.h"
#include "core/render/progressive.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

constexpr double kProbeRays = 20000.0;

struct Moments {
  double sum = 0.0;
  double square = 0.0;
  double count = 0.0;

  void add(double value) {
    value = std::clamp(value, 0.0, 1.0);
    sum += value;
    square += value * value;
    count += 1.0;
  }
  double deviation() const {
    if (count < 1.0) return 0.0;
    const double mean = sum / count;
    return std::sqrt(std::max(0.0, square / count - mean * mean));
  }
};

// Pixels on a regular grid over the sensor, as many as the budget of rays allows.
struct ProbeGrid {
  ProbeGrid(const Sensor& sensor, std::size_t lights) {
    const double rays_each = 1.0 + static_cast<double>(lights);
    const double pixels = static_cast<double>(sensor.width) * sensor.height;
    step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels * rays_each / kProbeRays))));
    columns = (sensor.width + step - 1) / step;
    rows = (sensor.height + step - 1) / step;
  }
  Vec2 raster(int i) const {
    return {(i % columns + 0.5) * step, (static_cast<double>(i / columns) + 0.5) * step};
  }
  int count() const { return columns * rows; }
  int step = 1;
  int columns = 0;
  int rows = 0;
};

// Steps in blur between neighbours on the grid. A step of a smooth slope may pass for an edge: an
// upper estimate.
void find_edges(const ProbeGrid& grid, const std::vector<double>& blur_px, ShotFacts& facts) {
  constexpr double kLeastStep = 0.5;  // px
  constexpr double kTileSide = 16.0;  // what is near is told by tiles
  double near = 0.0;
  double length = 0.0;
  double area = 0.0;
  const auto compare = [&](int i, int j) {
    const double p = blur_px[static_cast<std::size_t>(i)];
    const double q = blur_px[static_cast<std::size_t>(j)];
    const double step = std::abs(p - q);
    if (!(step > kLeastStep)) return;  // NaN too: darkness
    const double width = step + std::max(std::abs(p), std::abs(q));
    near += (width + kTileSide) * grid.step;
    length += grid.step;
    area += width * grid.step;
  };
  for (int i = 0; i < grid.count(); ++i) {
    if (i % grid.columns + 1 < grid.columns) compare(i, i + 1);
    if (i + grid.columns < grid.count()) compare(i, i + grid.columns);
  }
  const double all = static_cast<double>(grid.count()) * grid.step * grid.step;
  facts.edge_share = std::min(1.0, near / all);
  facts.edge_length = length / all;
  facts.edge_area = area / all;
}

void probe(const Shot& shot, ShotFacts& facts) {
  const RayScene& scene = *shot.scene;
  const PinholeCamera camera = central_projection(shot.camera, shot.sensor);
  const ProbeGrid grid(shot.sensor, scene.scene().lights.size());
  Moments moments;
  std::vector<double> blur_px(static_cast<std::size_t>(grid.count()),
                              std::numeric_limits<double>::quiet_NaN());
  for (int begin = 0; begin < grid.count(); begin += kLanes) {
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    ShadingInputs inputs{.scene = scene, .sequence = SampleSequence(shot.seed)};
    for (int lane = 0; lane < kLanes && begin + lane < grid.count(); ++lane) {
      const Ray ray = camera.ray(grid.raster(begin + lane), {});
      packet.set(lane, to_float(ray.origin), to_float(ray.direction), kFar, 0.0F);
      valid[static_cast<std::size_t>(lane)] = -1;
      inputs.keys.pixel[static_cast<std::size_t>(lane)] = static_cast<std::uint32_t>(begin + lane);
      ++facts.probe_rays;
    }
    scene.intersect(packet, valid, Coherence::coherent);
    LaneSurfaces surfaces;
    LaneColors colors;
    shade_locally(inputs, packet, valid, LaneFloats{}, surfaces, colors, facts.probe_rays);
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto k = static_cast<std::size_t>(lane);
      if (valid[k] == 0) continue;
      for (const float value : colors.get(lane)) moments.add(value);
      const Vec3f d = packet.direction(lane);
      const double cosine = dot(Vec3{d.x, d.y, d.z}, camera.pose().forward());
      const Length depth = packet.hit(lane) ? Length::si(packet.far[k] * cosine) : kInfinitelyFar;
      if (!packet.hit(lane) && scene.scene().background == Rgb{0, 0, 0}) continue;
      if (!(depth > Length{})) continue;  // a surface through the pupil has no blur disc
      const double blur = blur_diameter(shot.camera, depth) / shot.sensor.pixel_pitch;
      blur_px[static_cast<std::size_t>(begin + lane)] = blur;
      facts.largest_blur_px = std::max(facts.largest_blur_px, std::abs(blur));
      if (std::abs(blur) > 6.0) facts.blurred_share += 1.0 / grid.count();
    }
  }
  facts.contrast = moments.deviation();
  find_edges(grid, blur_px, facts);
}

}  // namespace

ShotFacts facts_of(const Shot& shot) {
  ShotFacts facts;
  facts.pixel_count = static_cast<double>(shot.sensor.width) * shot.sensor.height;
  facts.diffraction_q =
      shot.camera.wavelength * working_f_number(shot.camera) / shot.sensor.pixel_pitch;
  if (shot.scene == nullptr) {
    facts.largest_blur_px =
        std::abs(blur_diameter(shot.camera, kInfinitelyFar) / shot.sensor.pixel_pitch);
    facts.edge_share = 0.1;  // as of a few objects
    facts.edge_area = 0.02;
    facts.contrast = 0.25;  // half of what a picture of black and white pixels has
    return facts;
  }
  const Scene& scene = shot.scene->scene();
  facts.moves = shot.scene->moves() && shot.camera.shutter_seconds > 0.0;
  for (const Material& material : scene.materials) {
    facts.mirrors = facts.mirrors || material.reflection > 0.0 || material.transmission > 0.0;
  }
  if (facts.mirrors) {
    const BranchBound bound = branch_bound(scene.materials);
    facts.branch_error = bound.error;
    facts.forks = bound.forks;
  }
  for (const Light& light : scene.lights) {
    facts.area_lights = facts.area_lights || std::holds_alternative<AreaLight>(light.kind);
  }
  for (const TextureSource& texture : scene.textures) {
    facts.mip_maps = facts.mip_maps || texture.filter == TextureFilter::mipmap;
  }
  const EmitterChoice choice =
      emitter_choice(*shot.scene, camera_of(shot.camera, shot.sensor), exposure_of(shot.camera));
  facts.emitters_found = static_cast<int>(choice.found);
  facts.emitters_splatted = static_cast<int>(choice.emitters.size());
  probe(shot, facts);
  return facts;
}

double contrast_of(const Image& image) {
  Moments moments;
  for (const float value : image.pixels()) moments.add(value);
  return moments.deviation();
}

double curvature_of(const Image& image) {
  if (image.width() < 3 || image.height() < 3) return 0.0;
  double sum = 0.0;
  const auto value = [&](int x, int y, int c) {
    return std::clamp(static_cast<double>(image.at(x, y)[c]), 0.0, 1.0);
  };
  for (int y = 1; y + 1 < image.height(); ++y) {
    for (int x = 1; x + 1 < image.width(); ++x) {
      for (int c = 0; c < image.channels(); ++c) {
        const double laplacian = value(x - 1, y, c) + value(x + 1, y, c) + value(x, y - 1, c) +
                                 value(x, y + 1, c) - 4.0 * value(x, y, c);
        sum += laplacian * laplacian;
      }
    }
  }
  const double count =
      static_cast<double>(image.width() - 2) * (image.height() - 2) * image.channels();
  return std::sqrt(sum / count);
}

}  // namespace fstop
