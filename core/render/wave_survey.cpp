#include "core/render/wave_survey.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/render/progressive.h"
#include "core/shading/illumination.h"

namespace fstop {
namespace {

constexpr double kCoarseEdge = 0.5;  // px of disc diameter
constexpr double kFineEdge = 0.05;
constexpr std::size_t kMostSeen = 200'000;
constexpr double kMargin = 2.0;  // px: a pixel's own width on both sides

// `at`, any double, as a whole number from 0 to `end`; `unknown` for NaN.
int pixel_in(double at, int end, int unknown) {
  if (std::isnan(at)) return unknown;
  return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(end)));
}

class CentreRays {
 public:
  CentreRays(const Shot& shot, const WaveOptics& optics, WaveSurvey& survey)
      : scene_(*shot.scene),
        optics_(optics),
        survey_(survey),
        camera_(central_projection(shot.camera, survey.sensor)),
        dark_(shot.hides_background || scene_.scene().background == Rgb{0, 0, 0}) {}

  void trace_row(int y) {
    for (int x = 0; x < survey_.sensor.width; x += kLanes) trace(x, y);
  }

 private:
  void trace(int x, int y) {
    RayPacket packet;
    alignas(64) LaneMask valid = {};
    const int count = std::min(kLanes, survey_.sensor.width - x);
    for (int lane = 0; lane < count; ++lane) {
      const Ray ray = camera_.ray({x + lane + 0.5, y + 0.5}, {});
      packet.set(lane, to_float(ray.origin), to_float(ray.direction), kFar, 0.0F);
      packet.mask[static_cast<std::size_t>(lane)] = survey_.emitters.camera_mask;
      valid[static_cast<std::size_t>(lane)] = -1;
    }
    scene_.intersect(packet, valid, Coherence::coherent);
    const Vec3f forward = to_float(camera_.pose().forward());
    for (int lane = 0; lane < count; ++lane) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(survey_.sensor.width) +
                     static_cast<std::size_t>(x + lane);
      if (!packet.hit(lane)) {
        survey_.defocus[i] = dark_ ? std::numeric_limits<float>::quiet_NaN()
                                   : static_cast<float>(optics_.defocus(kFar));
        continue;
      }
      const float depth =
          packet.far[static_cast<std::size_t>(lane)] * dot(packet.direction(lane), forward);
      survey_.defocus[i] = static_cast<float>(optics_.defocus(depth));
      const Material& material = scene_.material(scene_.surface(packet, lane));
      survey_.mirrors[i] = material.reflection > 0.0 || material.transmission > 0.0 ? 1 : 0;
    }
  }

  const RayScene& scene_;
  const WaveOptics& optics_;
  WaveSurvey& survey_;
  PinholeCamera camera_;
  bool dark_;
};

// How far, in pixels, what happens in each tile of the surveyed sensor reaches.
class TileReach {
 public:
  TileReach(const WaveSurvey& survey)
      : survey_(survey),
        columns_((survey.sensor.width + kTile - 1) / kTile),
        rows_((survey.sensor.height + kTile - 1) / kTile),
        reach_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  void widen(int x, int y, double reach) {
    double& known = reach_[static_cast<std::size_t>((y / kTile) * columns_ + x / kTile)];
    known = std::max(known, reach);
  }
  // Tiles of the frame within reach of any tile.
  std::vector<char> frame_tiles() const {
    const int guard = survey_.guard / kTile;
    const int frame_columns = (survey_.sensor.width - 2 * survey_.guard + kTile - 1) / kTile;
    const int frame_rows = (survey_.sensor.height - 2 * survey_.guard + kTile - 1) / kTile;
    std::vector<char> tiles(static_cast<std::size_t>(frame_columns) *
                            static_cast<std::size_t>(frame_rows));
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const double reach = reach_[static_cast<std::size_t>(row * columns_ + column)];
        if (reach <= 0.0) continue;
        const int span = pixel_in(std::ceil(reach / kTile), columns_ + rows_, columns_ + rows_);
        for (int y = std::max(0, row - guard - span);
             y <= std::min(frame_rows - 1, row - guard + span); ++y) {
          for (int x = std::max(0, column - guard - span);
               x <= std::min(frame_columns - 1, column - guard + span); ++x) {
            tiles[static_cast<std::size_t>(y * frame_columns + x)] = 1;
          }
        }
      }
    }
    return tiles;
  }

 private:
  const WaveSurvey& survey_;
  int columns_;
  int rows_;
  std::vector<double> reach_;
};

double share_of(const std::vector<char>& tiles) {
  if (tiles.empty()) return 0.0;
  return static_cast<double>(std::ranges::count(tiles, char{1})) /
         static_cast<double>(tiles.size());
}

// Edges in depth between neighbouring pixels.
class EdgeFinder {
 public:
  EdgeFinder(const WaveSurvey& survey, const WaveOptics& optics, TileReach& reach)
      : survey_(survey), optics_(optics), reach_(reach) {}

  void visit(int x, int y) {
    if (x + 1 < survey_.sensor.width) compare(x, y, at(x + 1, y));
    if (y + 1 < survey_.sensor.height) compare(x, y, at(x, y + 1));
  }
  double occluded_share(double pixels) const { return std::min(1.0, occluded_pixels_ / pixels); }
  double fine_edge_loss(double pixels) const { return std::sqrt(fine_squares_ / pixels); }

 private:
  double at(int x, int y) const {
    return static_cast<double>(survey_.defocus[static_cast<std::size_t>(y) *
                                                   static_cast<std::size_t>(survey_.sensor.width) +
                                               static_cast<std::size_t>(x)]);
  }
  void compare(int x, int y, double other) {
    const double here = at(x, y);
    // Behind the edge is darkness: nothing of it can be hidden.
    if (std::isnan(here) || std::isnan(other)) return;
    const double p = optics_.disc_px(here);
    const double q = optics_.disc_px(other);
    const double step = std::abs(p - q);
    if (step > kCoarseEdge) {
      const double width = step + std::max(std::abs(p), std::abs(q));
      reach_.widen(x, y, 0.5 * width + kMargin);
      // Each pixel of the edge stands for a strip across it, and diffraction spreads
      // what happens there by its Airy diameter to both sides.
      occluded_pixels_ += width + 4.88 * optics_.q();
    } else if (step > kFineEdge) {
      fine_squares_ += std::pow(0.17 * step * step, 2);
    }
  }

  const WaveSurvey& survey_;
  const WaveOptics& optics_;
  TileReach& reach_;
  double fine_squares_ = 0.0;
  double occluded_pixels_ = 0.0;
};

// Whether a surveyed pixel shows something nearer than an emitter, and near enough to come between
// it and a part of the pupil: within half the difference of both discs' diameters.
bool something_before(const WaveSurvey& survey, const WaveOptics& optics,
                      const SplattedEmitter& emitter) {
  const double own = optics.disc_px(optics.defocus(emitter.depth));
  const double room = 0.5 * emitter.sharp_px + kMargin;
  double widest = 0.0;
  for (const double defocus : survey.seen) {
    widest = std::max(widest, std::abs(optics.disc_px(defocus) - own));
  }
  const double reach = 0.5 * kFarthestCorner * widest + room;
  // Emitters and reaches may be any number of pixels away or wide, or infinite.
  const auto from = [&](double middle, int end) { return pixel_in(middle - reach, end, 0); };
  const auto to = [&](double middle, int end) { return pixel_in(middle + reach + 1.0, end, end); };
  const Sensor& sensor = survey.sensor;
  for (int y = from(emitter.raster.y, sensor.height); y < to(emitter.raster.y, sensor.height);
       ++y) {
    for (int x = from(emitter.raster.x, sensor.width); x < to(emitter.raster.x, sensor.width);
         ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(survey.sensor.width) +
                     static_cast<std::size_t>(x);
      // Nearer is more defocused towards positive U; NaN is darkness.
      const double step = optics.disc_px(static_cast<double>(survey.defocus[i])) - own;
      if (!(step > kCoarseEdge)) continue;
      const double away = std::hypot(x + 0.5 - emitter.raster.x, y + 0.5 - emitter.raster.y);
      if (away <= 0.5 * kFarthestCorner * step + room) return true;
    }
  }
  return false;
}

// A point of an object, as many as tell its depth where it is small.
Vec3 place_of(const Object& object) {
  if (const auto* sphere = std::get_if<SphereObject>(&object.shape)) return sphere->center;
  const auto& mesh = std::get<MeshObject>(object.shape).mesh;
  Vec3 sum = {};
  for (const auto& p : mesh.positions) {
    sum = sum + Vec3{double{p[0]}, double{p[1]}, double{p[2]}};
  }
  return sum * (1.0 / std::max<double>(1.0, static_cast<double>(mesh.positions.size())));
}

// Objects too small for the centre rays may be stars.
void see_objects(const Shot& shot, const WaveOptics& optics, WaveSurvey& survey) {
  const PinholeCamera camera = central_projection(shot.camera, survey.sensor);
  for (const Object& object : shot.scene->scene().objects) {
    const double depth = dot(place_of(object) - camera.pose().position(), camera.pose().forward());
    if (depth > 0.0) survey.seen.push_back(optics.defocus(depth));
  }
  for (const SplattedEmitter& emitter : survey.emitters.emitters) {
    survey.seen.push_back(optics.defocus(emitter.depth));
  }
}

}  // namespace

int light_reach(const Shot& shot, const ShotFacts& facts, const WaveOptics& optics) {
  const double halo = 13.0 * optics.q() * std::sqrt(0.01 / shot.quality.max_error);
  const double wanted = 0.5 * facts.largest_blur_px + halo + kMargin;
  const double most = 0.5 * std::max(shot.sensor.width, shot.sensor.height) + kMargin;
  return static_cast<int>(std::ceil(std::min(wanted, most)));
}

WaveSurvey wave_survey(const Shot& shot, const ShotFacts& facts, const WaveOptics& optics,
                       const RunControl& run) {
  WaveSurvey survey;
  survey.light_reach = light_reach(shot, facts, optics);
  survey.guard = (survey.light_reach + kTile - 1) / kTile * kTile;
  survey.sensor = {.pixel_pitch = shot.sensor.pixel_pitch,
                   .width = shot.sensor.width + 2 * survey.guard,
                   .height = shot.sensor.height + 2 * survey.guard};
  const Camera camera = camera_of(shot.camera, survey.sensor);
  const float exposure = sample_source(shot, camera, true).exposure;
  survey.emitters = emitter_choice(*shot.scene, camera, double{exposure});
  const auto pixels = static_cast<std::size_t>(survey.sensor.width) *
                      static_cast<std::size_t>(survey.sensor.height);
  survey.defocus.resize(pixels);
  survey.mirrors.resize(pixels);
  survey.rays = pixels;
  CentreRays rays(shot, optics, survey);
  parallel_for(run, survey.sensor.height, [&](int y) { rays.trace_row(y); });
  const std::size_t stride = pixels / kMostSeen + 1;
  for (std::size_t i = 0; i < pixels; i += stride) {
    if (!std::isnan(survey.defocus[i])) survey.seen.push_back(double{survey.defocus[i]});
  }
  see_objects(shot, optics, survey);
  return survey;
}

bool VisibilityMask::covers(int x, int y) const noexcept {
  const int columns = (width + kTile - 1) / kTile;
  return tiles[static_cast<std::size_t>((y / kTile) * columns + x / kTile)] != 0;
}

VisibilityMask visibility_mask(const WaveSurvey& survey, const WaveOptics& optics,
                               const DepthNodes& nodes) {
  TileReach edges(survey);
  TileReach others(survey);
  EdgeFinder finder(survey, optics, edges);
  const auto surveyed = static_cast<double>(survey.defocus.size());
  double beyond = 0.0;
  for (int y = 0; y < survey.sensor.height; ++y) {
    for (int x = 0; x < survey.sensor.width; ++x) {
      finder.visit(x, y);
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(survey.sensor.width) +
                     static_cast<std::size_t>(x);
      const double defocus = static_cast<double>(survey.defocus[i]);
      if (std::isnan(defocus)) continue;
      const bool is_beyond = nodes.place(defocus).first < 0;
      beyond += is_beyond ? 1.0 : 0.0;
      if (survey.mirrors[i] != 0 || is_beyond) {
        others.widen(x, y, 0.5 * std::abs(optics.disc_px(defocus)) + kMargin);
      }
    }
  }
  // Splatted emitters are not surveyed: those too defocused for the nodes, and those that
  // something may partly hide, are the rays' own, too.
  double hidden = 0.0;
  for (const SplattedEmitter& emitter : survey.emitters.emitters) {
    const bool is_beyond = nodes.place(optics.defocus(emitter.depth)).first < 0;
    const bool is_hidden = something_before(survey, optics, emitter);
    if (!is_beyond && !is_hidden) continue;
    const int x = pixel_in(emitter.raster.x, survey.sensor.width - 1, 0);
    const int y = pixel_in(emitter.raster.y, survey.sensor.height - 1, 0);
    const double away = std::hypot(x - emitter.raster.x, y - emitter.raster.y);
    const double wide = kFarthestCorner * emitter.blur_px + emitter.sharp_px;
    others.widen(x, y, 0.5 * wide + away + kMargin);
    beyond += is_beyond ? emitter.footprint_px() : 0.0;
    hidden += is_hidden ? std::pow(wide + 4.88 * optics.q(), 2) : 0.0;
  }
  VisibilityMask mask{.width = survey.sensor.width - 2 * survey.guard,
                      .height = survey.sensor.height - 2 * survey.guard,
                      .tiles = edges.frame_tiles()};
  const std::vector<char> more = others.frame_tiles();
  for (std::size_t i = 0; i < more.size(); ++i) mask.tiles[i] = mask.tiles[i] | more[i];
  mask.share = share_of(mask.tiles);
  mask.occluded_share = std::min(1.0, finder.occluded_share(surveyed) + hidden / surveyed);
  mask.beyond_share = std::min(1.0, beyond / surveyed);
  mask.fine_edge_loss = finder.fine_edge_loss(surveyed);
  return mask;
}

}  // namespace fstop
