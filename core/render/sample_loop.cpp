#include "core/render/sample_loop.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "core/error.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

static_assert(kTile % kLanes == 0, "a row of a tile is a whole number of packets");
// Samples of a pixel traced in one visit of its tile: a visit takes milliseconds, so that
// progress flows and threads end together.
constexpr std::uint32_t kVisit = 256;

// Coordinates of a packet's samples beside those of the raster.
struct LanePoints {
  alignas(64) LaneValues pupil_x = {};
  alignas(64) LaneValues pupil_y = {};
  alignas(64) LaneValues time = {};
};

void choose_points(const SampleSource& source, const SampleKeys& keys, TracedPacket& traced,
                   LanePoints& points) {
  source.sequence.fill(keys, Dimension::pixel_x, traced.raster_x);
  source.sequence.fill(keys, Dimension::pixel_y, traced.raster_y);
  const auto width = static_cast<std::uint32_t>(source.sensor.width);
  for (std::size_t i = 0; i < kLanes; ++i) {
    traced.raster_x[i] += keys.pixel[i] % width;
    traced.raster_y[i] += keys.pixel[i] / width;
  }
  if (source.samples_pupil) {
    source.sequence.fill(keys, Dimension::lens_u, points.pupil_x);
    source.sequence.fill(keys, Dimension::lens_v, points.pupil_y);
    source.pupil.apply(points.pupil_x, points.pupil_y);
  }
  if (source.shutter_seconds > 0.0F) {
    source.sequence.fill(keys, Dimension::time, points.time);
    for (double& t : points.time) t *= source.shutter_seconds / kLongestShutter;
  }
}

template <typename AnyCamera>
void aim(const AnyCamera& camera, const TracedPacket& traced, const LanePoints& points,
         std::uint32_t mask, RayPacket& packet) {
  for (int i = 0; i < kLanes; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Ray ray = camera.ray({traced.raster_x[k], traced.raster_y[k]},
                               {points.pupil_x[k], points.pupil_y[k]});
    packet.set(i, to_float(ray.origin), to_float(ray.direction), kFar,
               static_cast<float>(points.time[k]));
    packet.mask[k] = mask;
  }
}

// The angle of one pixel at the image's centre: a ray's footprint grows by it per metre.
float pixel_angle(const SampleSource& source) {
  const Length distance =
      std::visit([](const auto& camera) { return camera.image_distance(); }, source.camera);
  return static_cast<float>(source.sensor.pixel_pitch / distance);
}

template <typename AnyCamera>
std::uint64_t trace_with(const SampleSource& source, const AnyCamera& camera,
                         const SampleKeys& keys, const LaneMask& valid, TracedPacket& traced) {
  LanePoints points;
  choose_points(source, keys, traced, points);
  RayPacket packet;
  aim(camera, traced, points, source.mask, packet);
  source.scene.intersect(packet, valid, Coherence::coherent);
  std::uint64_t rays = 0;
  for (const std::int32_t lane : valid) rays += lane != 0 ? 1U : 0U;
  const ShadingInputs inputs{.scene = source.scene,
                             .sequence = source.sequence,
                             .keys = keys,
                             .footprint_rate = source.texture_width_px * pixel_angle(source)};
  LaneColors& colors = traced.colors;
  shade(inputs, packet, valid, colors, rays);
  const Vec3f forward = to_float(camera.pose().forward());
  for (std::size_t k = 0; k < kLanes; ++k) {
    const auto lane = static_cast<int>(k);
    traced.depth[k] =
        packet.hit(lane) ? packet.far[k] * dot(packet.direction(lane), forward) : kFar;
    float scale = source.exposure;
    if (source.falloff) {
      scale *= static_cast<float>(camera.falloff({traced.raster_x[k], traced.raster_y[k]}));
    }
    colors.r[k] *= scale;
    colors.g[k] *= scale;
    colors.b[k] *= scale;
  }
  return rays;
}

// Which samples of which pixels of a row share a packet: few samples of several neighbours, or
// kLanes samples of one pixel.
struct RowLayout {
  explicit RowLayout(std::uint32_t count)
      : per_pixel(std::min<std::uint32_t>(count, kLanes)), pixels(kLanes / per_pixel) {}
  std::uint32_t per_pixel;
  std::uint32_t pixels;
};

class TileTracer {
 public:
  TileTracer(const SampleSource& source, std::uint32_t first, std::uint32_t count, Film& film,
             SampleSink* sink)
      : source_(source), first_(first), count_(count), layout_(count), film_(film), sink_(sink) {}

  std::uint64_t trace(int tile_x, int tile_y, const RunControl& run) {
    std::uint64_t rays = 0;
    const int right = std::min((tile_x + 1) * kTile, film_.width());
    const int bottom = std::min((tile_y + 1) * kTile, film_.height());
    const int step = static_cast<int>(layout_.pixels);
    for (int y = tile_y * kTile; y < bottom; ++y) {
      for (int x = tile_x * kTile; x < right; x += step) {
        if (run.stop.stop_requested()) return rays;
        rays += trace_pixels(x, y, std::min(step, right - x));
      }
    }
    return rays;
  }

 private:
  std::uint64_t trace_pixels(int x, int y, int pixels) {
    std::array<PixelSums, kLanes> sums = {};
    SampleKeys keys;
    alignas(64) LaneMask valid = {};
    std::uint64_t rays = 0;
    const auto row = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(film_.width());
    for (std::uint32_t begin = 0; begin < count_; begin += layout_.per_pixel) {
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t neighbour = lane / layout_.per_pixel;
        const bool inside = neighbour < static_cast<std::uint32_t>(pixels);
        valid[lane] = inside ? -1 : 0;
        keys.pixel[lane] = row + static_cast<std::uint32_t>(x) + (inside ? neighbour : 0);
        keys.index[lane] = first_ + begin + lane % layout_.per_pixel;
      }
      TracedPacket traced;
      rays += trace_packet(source_, keys, valid, traced);
      if (sink_ != nullptr) sink_->add(valid, traced);
      const LaneColors& colors = traced.colors;
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        if (valid[lane] == 0) continue;
        sums[lane / layout_.per_pixel].add(colors.r[lane], colors.g[lane], colors.b[lane]);
      }
    }
    for (int i = 0; i < pixels; ++i) film_.add(x + i, y, sums[static_cast<std::size_t>(i)]);
    return rays;
  }

  const SampleSource& source_;
  std::uint32_t first_;
  std::uint32_t count_;
  RowLayout layout_;
  Film& film_;
  SampleSink* sink_;
};

// Reports a fraction that never decreases, from any thread.
class Progress {
 public:
  Progress(const RunControl& run, int total, double begin, double end)
      : run_(run), total_(total), begin_(begin), end_(end) {}
  void step() {
    const int done = 1 + done_.fetch_add(1);
    if (!run_.progress) return;
    const double fraction = begin_ + (end_ - begin_) * done / total_;
    const std::scoped_lock lock(mutex_);
    if (fraction <= reported_) return;
    reported_ = fraction;
    run_.progress(fraction);
  }

 private:
  const RunControl& run_;
  int total_;
  double begin_;
  double end_;
  std::atomic<int> done_ = 0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

}  // namespace

std::uint64_t trace_packet(const SampleSource& source, const SampleKeys& keys,
                           const LaneMask& valid, TracedPacket& traced) noexcept {
  return std::visit(
      [&](const auto& camera) { return trace_with(source, camera, keys, valid, traced); },
      source.camera);
}

std::uint64_t trace_pass(const SampleSource& source, const SamplePass& pass, Film& film,
                         const RunControl& run) {
  const int columns = (film.width() + kTile - 1) / kTile;
  const int rows = (film.height() + kTile - 1) / kTile;
  const std::uint32_t visit = std::min(pass.count, kVisit);
  std::atomic<std::uint64_t> rays = 0;
  Progress progress(run, columns * rows * static_cast<int>(pass.count / visit), pass.begin,
                    pass.end);
  for (std::uint32_t done = 0; done < pass.count; done += visit) {
    parallel_for(run, columns * rows, [&](int tile) {
      if (pass.tiles == nullptr || (*pass.tiles)[static_cast<std::size_t>(tile)] != 0) {
        TileTracer tracer(source, pass.first + done, visit, film, pass.sink);
        rays += tracer.trace(tile % columns, tile / columns, run);
      }
      progress.step();
    });
  }
  throw_if_stopped(run);
  return rays;
}

}  // namespace fstop
