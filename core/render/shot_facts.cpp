#include "core/render/shot_facts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/film/block.h"
#include "core/render/emitter_choice.h"
#include "core/render/light_aim.h"
#include "core/render/progressive.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

// Whether a lookup averages over a width, so that detail is lost.
bool averages(TextureFilter filter) {
  return filter == TextureFilter::mipmap || filter == TextureFilter::summed_area ||
         filter == TextureFilter::stochastic || filter == TextureFilter::anisotropic;
}

constexpr double kProbeRays = 20000.0;
constexpr double kWideBlur = 6.0;  // px

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
  void add(const Moments& other) {
    sum += other.sum;
    square += other.square;
    count += other.count;
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

// Tiles around which, a grid's step further, nothing is blurred less than kSoftBlur.
std::vector<std::uint8_t> soft_tiles(const ProbeGrid& grid, const std::vector<double>& blur_px,
                                     const Sensor& sensor) {
  constexpr double kSoftBlur = 6.0;  // px: less leaves no window to share samples in
  const BlockGrid tiles(sensor.width, sensor.height);
  const auto range = [&](int tile, int count) {
    return std::pair{std::max(0, tile * kTile / grid.step - 1),
                     std::min(count - 1, (tile + 1) * kTile / grid.step + 1)};
  };
  std::vector<std::uint8_t> soft;
  for (int row = 0; row < tiles.tile_rows(); ++row) {
    const auto [top, bottom] = range(row, grid.rows);
    for (int column = 0; column < tiles.tile_columns(); ++column) {
      const auto [left, right] = range(column, grid.columns);
      bool is_soft = true;
      for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
          const double blur = blur_px[static_cast<std::size_t>(y * grid.columns + x)];
          is_soft = is_soft && !(std::abs(blur) < kSoftBlur);  // NaN, darkness, is soft
        }
      }
      soft.push_back(is_soft ? 1 : 0);
    }
  }
  return soft;
}

// What some packets of the probe found.
struct ProbePart {
  Moments moments = {};
  int wide_blurs = 0;  // points with a blur disc over kWideBlur
  int branches = 0;    // points on what reflects or transmits
  int mirrors = 0;     // of them, on what shows other things as they are
  double largest_blur_px = 0.0;
  float brightest = 0.0F;  // radiance
  std::uint64_t rays = 0;
};

class Probe {
 public:
  explicit Probe(const Shot& shot)
      : shot_(shot),
        camera_(central_projection(shot.camera, shot.sensor)),
        grid_(shot.sensor, shot.scene->scene().lights.size()),
        blur_px_(static_cast<std::size_t>(grid_.count()),
                 std::numeric_limits<double>::quiet_NaN()) {}

  void run(ShotFacts& facts, const RunControl& control) {
    constexpr int kPart = 16 * kLanes;
    std::vector<ProbePart> parts(static_cast<std::size_t>((grid_.count() + kPart - 1) / kPart));
    parallel_for(control, static_cast<int>(parts.size()), [&](int i) {
      ProbePart& part = parts[static_cast<std::size_t>(i)];
      const int end = std::min(grid_.count(), (i + 1) * kPart);
      for (int begin = i * kPart; begin < end; begin += kLanes) trace(begin, part);
    });
    Moments moments;
    for (const ProbePart& part : parts) {
      moments.add(part.moments);
      facts.largest_blur_px = std::max(facts.largest_blur_px, part.largest_blur_px);
      facts.probe_rays += part.rays;
      facts.brightest = std::max(facts.brightest, double{part.brightest});
      facts.blurred_share += double(part.wide_blurs) / grid_.count();
      facts.branch_share += double(part.branches) / grid_.count();
      facts.mirror_share += double(part.mirrors) / grid_.count();
    }
    facts.contrast = moments.deviation();
    find_edges(grid_, blur_px_, facts);
    facts.soft_tiles = soft_tiles(grid_, blur_px_, shot_.sensor);
  }

 private:
  void trace(int begin, ProbePart& part) {
    const RayScene& scene = *shot_.scene;
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    FilmPlaces film(shot_.sensor.width, shot_.sensor.height, 0.0F);
    ShadingInputs inputs{.scene = scene,
                         .sequence = SampleSequence(shot_.seed),
                         .film = &film,
                         .without_background = shot_.hides_background ? kAllLanes : 0U};
    for (int lane = 0; lane < kLanes && begin + lane < grid_.count(); ++lane) {
      const Vec2 raster = grid_.raster(begin + lane);
      film.set(static_cast<std::size_t>(lane), static_cast<float>(raster.x),
               static_cast<float>(raster.y));
      const Ray ray = camera_.ray(raster, {});
      packet.set(lane, to_float(ray.origin), to_float(ray.direction), kFar, 0.0F);
      valid[static_cast<std::size_t>(lane)] = -1;
      inputs.keys.pixel[static_cast<std::size_t>(lane)] = static_cast<std::uint32_t>(begin + lane);
      ++part.rays;
    }
    scene.intersect(packet, valid, Coherence::coherent);
    LaneSurfaces surfaces;
    LaneColors colors;
    shade_locally(inputs, packet, valid, LaneFloats{}, surfaces, colors, part.rays);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (valid[static_cast<std::size_t>(lane)] == 0) continue;
      for (const float value : colors.get(lane)) {
        part.moments.add(value);
        part.brightest = std::max(part.brightest, value);
      }
      measure_blur(packet, lane, begin + lane, part);
      const std::int32_t material = surfaces.material[static_cast<std::size_t>(lane)];
      if (branches(material)) ++part.branches;
      if (material >= 0 && shows_others(scene.material(material))) ++part.mirrors;
    }
  }

  static bool shows_others(const Material& m) { return m.reflection > 0.0 || m.transmission > 0.0; }

  bool branches(std::int32_t material) const {
    if (material < 0) return false;
    const Material& m = shot_.scene->material(material);
    switch (shot_.illumination) {
      case Illumination::local:
        return false;
      case Illumination::recursive:
        break;
      case Illumination::global:
        if (m.model != ShadingModel::unlit) return true;
    }
    return shows_others(m);
  }

  void measure_blur(const RayPacket& packet, int lane, int point, ProbePart& part) {
    const bool is_dark = shot_.hides_background || shot_.scene->scene().background == Rgb{0, 0, 0};
    if (!packet.hit(lane) && is_dark) return;
    const Vec3f d = packet.direction(lane);
    const double cosine = dot(Vec3{d.x, d.y, d.z}, camera_.pose().forward());
    const Length depth = packet.hit(lane)
                             ? Length::si(packet.far[static_cast<std::size_t>(lane)] * cosine)
                             : kInfinitelyFar;
    if (!(depth > Length{})) return;  // a surface through the pupil has no blur disc
    const double blur = blur_diameter(shot_.camera, depth) / shot_.sensor.pixel_pitch;
    blur_px_[static_cast<std::size_t>(point)] = blur;
    part.largest_blur_px = std::max(part.largest_blur_px, std::abs(blur));
    if (std::abs(blur) > kWideBlur) ++part.wide_blurs;
  }

  const Shot& shot_;
  PinholeCamera camera_;
  ProbeGrid grid_;
  std::vector<double> blur_px_;
};

// The sum of term(i) for i in [0, count), a row's: in single precision, in lanes, so that loops
// vectorise.
template <typename Term>
double lane_sum(std::size_t count, const Term& term) {
  constexpr std::size_t kWide = 16;
  std::array<float, kWide> lanes = {};
  std::size_t i = 0;
  for (; i + kWide <= count; i += kWide) {
    for (std::size_t k = 0; k < kWide; ++k) lanes[k] += term(i + k);
  }
  for (std::size_t k = 0; i + k < count; ++k) lanes[k] += term(i + k);
  double sum = 0.0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  return sum;
}

float clipped(float value) { return value < 0.0F ? 0.0F : (value > 1.0F ? 1.0F : value); }

// row_sum(y) for every row of [begin, end), added in order: the same whatever the threads.
template <typename RowSumOf>
double sum_of_rows(int begin, int end, const RunControl& run, const RowSumOf& row_sum) {
  std::vector<double> rows(static_cast<std::size_t>(std::max(0, end - begin)));
  parallel_for(run, static_cast<int>(rows.size()),
               [&](int i) { rows[static_cast<std::size_t>(i)] = row_sum(begin + i); });
  double sum = 0.0;
  for (const double row : rows) sum += row;
  return sum;
}

}  // namespace

ShotFacts facts_of(const Shot& shot, const RunControl& run) {
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
  facts.camera_moves = shot.camera.velocity != Vec3{} && shot.camera.shutter_seconds > 0.0 &&
                       shot.effects.motion != EffectChoice::off;
  facts.moves =
      (shot.scene->moves() || shot.camera.velocity != Vec3{}) && shot.camera.shutter_seconds > 0.0;
  for (const Material& material : scene.materials) {
    facts.mirrors = facts.mirrors || material.reflection > 0.0 || material.transmission > 0.0;
    facts.interreflects = facts.interreflects || material.model != ShadingModel::unlit;
  }
  facts.interreflects = facts.interreflects && shot.illumination == Illumination::global;
  for (const Light& light : scene.lights) {
    facts.area_lights = facts.area_lights || std::holds_alternative<AreaLight>(light.kind);
  }
  facts.carries_light = !light_aims(*shot.scene, shot.illumination).empty();
  for (const TextureSource& texture : scene.textures) {
    facts.averages_texels = facts.averages_texels || averages(texture.filter);
  }
  const EmitterChoice choice =
      emitter_choice(*shot.scene, camera_of(shot.camera, shot.sensor), exposure_of(shot.camera));
  facts.emitters_found = static_cast<int>(choice.found);
  facts.emitters_splatted = static_cast<int>(choice.emitters.size());
  for (const SplattedEmitter& emitter : choice.emitters) {
    const Rgb& radiance = shot.scene->emitters()[emitter.number].radiance;
    const double brightest = static_cast<double>(std::max({radiance[0], radiance[1], radiance[2]}));
    const double sharp_px = std::numbers::pi / 4.0 * std::pow(emitter.sharp_px, 2);
    facts.emitter_px +=
        std::min(brightest * exposure_of(shot.camera) * sharp_px, emitter.footprint_px());
  }
  Probe(shot).run(facts, run);
  const double exposure = exposure_of(shot.camera);
  facts.brightest =
      std::max(exposure * facts.brightest, double{brightest_value(*shot.scene, exposure)});
  if (facts.mirrors || facts.interreflects) {
    const BranchBound bound = branch_bound(scene.materials, shot.illumination, facts.brightest);
    facts.branch_error = bound.error;
    facts.forks = bound.forks;
  }
  const bool shows_others = facts.mirrors && shot.illumination != Illumination::local;
  if (shows_others) {  // what they show may be as far as anything
    const double far = blur_diameter(shot.camera, kInfinitelyFar) / shot.sensor.pixel_pitch;
    facts.largest_blur_px = std::max(facts.largest_blur_px, std::abs(far));
  }
  // The probe shades what it meets, not what that shows: as where no scene is known.
  if (shows_others || facts.interreflects) facts.contrast = std::max(facts.contrast, 0.25);
  return facts;
}

double contrast_of(const Image& image, const RunControl& run) {
  if (image.empty()) return 0.0;
  const auto width = static_cast<std::size_t>(image.width() * image.channels());
  const double count = static_cast<double>(width) * image.height();
  const double mean =
      sum_of_rows(0, image.height(), run,
                  [&](int y) {
                    const float* row = image.at(0, y);
                    return lane_sum(width, [&](std::size_t i) { return clipped(row[i]); });
                  }) /
      count;
  const auto centre = static_cast<float>(mean);
  const double square = sum_of_rows(0, image.height(), run, [&](int y) {
    const float* row = image.at(0, y);
    return lane_sum(width, [&](std::size_t i) {
      const float off = clipped(row[i]) - centre;
      return off * off;
    });
  });
  return std::sqrt(square / count);
}

double curvature_of(const Image& image, const RunControl& run) {
  if (image.width() < 3 || image.height() < 3) return 0.0;
  const auto channels = static_cast<std::size_t>(image.channels());
  const std::size_t inner = channels * static_cast<std::size_t>(image.width() - 2);
  const double sum = sum_of_rows(1, image.height() - 1, run, [&](int y) {
    const float* left = image.at(0, y);
    const float* middle = image.at(1, y);
    const float* right = image.at(2, y);
    const float* above = image.at(1, y - 1);
    const float* below = image.at(1, y + 1);
    return lane_sum(inner, [&](std::size_t i) {
      const float laplacian = clipped(left[i]) + clipped(right[i]) + clipped(above[i]) +
                              clipped(below[i]) - 4.0F * clipped(middle[i]);
      return laplacian * laplacian;
    });
  });
  return std::sqrt(sum / (static_cast<double>(inner) * (image.height() - 2)));
}

}  // namespace fstop
