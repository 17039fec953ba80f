#include "core/render/block_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/shading/ray_tree.h"
#include "core/simd.h"

namespace fstop {
namespace {

AimFrame frame_of(const Camera& camera) {
  return std::visit([](const auto& any) { return any.aim_frame(); }, camera);
}

LaneWords pixels_of(const BlockGrid& grid, std::size_t block) {
  LaneWords pixels = {};
  grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
    pixels[lane] = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(grid.width) +
                   static_cast<std::uint32_t>(x);
  });
  return pixels;
}

// One pupil point's packet: all rays start there.
struct Bundle {
  Vec3f origin = {};
  Vec3f right = {};
  Vec3f down = {};
  Vec3f forward = {};
  float slope = 0.0F;
  float shift_x = 0.0F;  // of the slopes, by the pupil point
  float shift_y = 0.0F;
};

FSTOP_KERNEL void aim(const Bundle& bundle, const LaneFloats& corner_x, const LaneFloats& corner_y,
                      const LaneFloats& jitter_x, const LaneFloats& jitter_y, RayPacket& packet) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float ax = corner_x[k] + jitter_x[k] * bundle.slope - bundle.shift_x;
    const float ay = corner_y[k] + jitter_y[k] * bundle.slope - bundle.shift_y;
    const float dx = bundle.forward.x + ax * bundle.right.x + ay * bundle.down.x;
    const float dy = bundle.forward.y + ax * bundle.right.y + ay * bundle.down.y;
    const float dz = bundle.forward.z + ax * bundle.right.z + ay * bundle.down.z;
    const float scale = 1.0F / std::sqrt(dx * dx + dy * dy + dz * dz);
    packet.org_x[k] = bundle.origin.x;
    packet.org_y[k] = bundle.origin.y;
    packet.org_z[k] = bundle.origin.z;
    packet.dir_x[k] = dx * scale;
    packet.dir_y[k] = dy * scale;
    packet.dir_z[k] = dz * scale;
    packet.far[k] = kFar;
    packet.object[k] = kNoHit;
  }
}

// Every ray begins where the camera is at its time.
FSTOP_KERNEL void move_origins(Vec3f velocity, RayPacket& packet) {
  constexpr auto kUnit = static_cast<float>(kLongestShutter);
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float seconds = kUnit * packet.time[k];
    packet.org_x[k] += seconds * velocity.x;
    packet.org_y[k] += seconds * velocity.y;
    packet.org_z[k] += seconds * velocity.z;
  }
}

// The chief ray's cosine to the fourth power: 1/(1 + a^2)^2 of its slopes.
FSTOP_KERNEL void fall_off(const LaneFloats& corner_x, const LaneFloats& corner_y, float slope,
                           TracedPacket& traced) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float ax = corner_x[k] + traced.jitter_x[k] * slope;
    const float ay = corner_y[k] + traced.jitter_y[k] * slope;
    const float squared = 1.0F / (1.0F + ax * ax + ay * ay);
    const float factor = squared * squared;
    traced.colors.r[k] *= factor;
    traced.colors.g[k] *= factor;
    traced.colors.b[k] *= factor;
  }
}

FSTOP_KERNEL void finish(const RayPacket& packet, Vec3f forward, float exposure,
                         TracedPacket& traced) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float cosine =
        packet.dir_x[k] * forward.x + packet.dir_y[k] * forward.y + packet.dir_z[k] * forward.z;
    const float depth = packet.far[k] * cosine;
    traced.depth[k] = packet.object[k] != kNoHit ? depth : kFar;
    traced.colors.r[k] *= exposure;
    traced.colors.g[k] *= exposure;
    traced.colors.b[k] *= exposure;
  }
}
// Few samples in single precision, their sums in double.
struct alignas(64) PartialSums {
  LaneFloats r = {}, g = {}, b = {};
};

FSTOP_KERNEL void add(const LaneColors& colors, PartialSums& sums) {
  for (std::size_t k = 0; k < kLanes; ++k) {
    sums.r[k] += colors.r[k];
    sums.g[k] += colors.g[k];
    sums.b[k] += colors.b[k];
  }
}
}  // namespace

BlockTracer::BlockTracer(const SampleSource& source, const BlockGrid& grid,
                         std::size_t block) noexcept
    : source_(source),
      frame_(frame_of(source.camera)),
      right_(to_float(frame_.right)),
      down_(to_float(frame_.down)),
      forward_(to_float(frame_.forward)),
      slope_(static_cast<float>(frame_.slope)),
      block_(static_cast<std::uint32_t>(block)),
      inputs_{.scene = source.scene,
              .sequence = source.sequence,
              .keys = {.pixel = pixels_of(grid, block)},
              .footprint_rate = source.texture_width_px * slope_,
              .certain_light = source.certain_light,
              .brightest = source.brightest,
              .without_background = source.hides_background ? kAllLanes : 0U,
              .illumination = source.illumination},
      pixel_x_(source.sequence, Dimension::pixel_x, inputs_.keys.pixel),
      pixel_y_(source.sequence, Dimension::pixel_y, inputs_.keys.pixel),
      time_(source.sequence, Dimension::time, inputs_.keys.pixel),
      is_cut_(source.scene.branches() || source.illumination == Illumination::global) {
  grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
    valid_[lane] = -1;
    ++lanes_;
    corner_x_[lane] = static_cast<float>((x - frame_.centre.x) * frame_.slope);
    corner_y_[lane] = static_cast<float>((y - frame_.centre.y) * frame_.slope);
    pixel_left_[lane] = static_cast<float>(x);
    pixel_top_[lane] = static_cast<float>(y);
  });
  if (source.scene.has_screen_maps()) {
    inputs_.film = &film_;
    film_ = FilmPlaces(source.sensor.width, source.sensor.height, source.texture_width_px);
  }
  if (source.samples_pupil && source.texture_disc_share > 0.0F) {
    inputs_.pencil = &pencil_;
    pencil_.width = source.texture_disc_share * static_cast<float>(2.0 * frame_.radius);
    pencil_.vergence = static_cast<float>(frame_.vergence);
  }
  // What no sample changes; Embree leaves it alone.
  packet_.mask.fill(source.mask);
  packet_.instance.fill(kNoHit);
}

void BlockTracer::choose_pupil_points(std::uint32_t chunk) noexcept {
  chunk_ = chunk;
  SampleKeys keys;
  keys.pixel.fill(block_);
  for (std::uint32_t k = 0; k < kLanes; ++k) keys.index[k] = chunk * kLanes + k;
  source_.sequence.fill(keys, Dimension::lens_u, pupil_x_);
  source_.sequence.fill(keys, Dimension::lens_v, pupil_y_);
  source_.pupil.apply(pupil_x_, pupil_y_);
}

FSTOP_KERNEL std::uint64_t BlockTracer::trace_any(std::uint32_t index,
                                                  TracedPacket& traced) noexcept {
  pixel_x_.fill(index, traced.jitter_x);
  pixel_y_.fill(index, traced.jitter_y);
  Bundle bundle{.origin = to_float(frame_.position),
                .right = right_,
                .down = down_,
                .forward = forward_,
                .slope = slope_};
  if (source_.samples_pupil) {
    if (index / kLanes != chunk_) choose_pupil_points(index / kLanes);
    const double px = pupil_x_[index % kLanes] * frame_.radius;
    const double py = pupil_y_[index % kLanes] * frame_.radius;
    bundle.origin = to_float(frame_.position + frame_.right * px + frame_.down * py);
    bundle.shift_x = static_cast<float>(px * frame_.vergence);
    bundle.shift_y = static_cast<float>(py * frame_.vergence);
  }
  RayPacket& packet = packet_;
  aim(bundle, corner_x_, corner_y_, traced.jitter_x, traced.jitter_y, packet);
  if (source_.shutter_seconds > 0.0F) {
    time_.fill(index, packet.time);
    const auto share = source_.shutter_seconds / static_cast<float>(kLongestShutter);
    for (float& t : packet.time) t *= share;
    if (source_.velocity != Vec3f{}) move_origins(source_.velocity, packet);
  }
  source_.scene.intersect(packet, valid_, Coherence::coherent);
  std::uint64_t rays = lanes_;
  inputs_.keys.index.fill(index);
  if (is_cut_) {
    cut_.fill(0.0F);
    inputs_.cut = &cut_;
  }
  if (inputs_.film != nullptr) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      film_.set(k, pixel_left_[k] + traced.jitter_x[k], pixel_top_[k] + traced.jitter_y[k]);
    }
  }
  if (inputs_.pencil != nullptr) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      pencil_.cosines[k] = packet.dir_x[k] * forward_.x + packet.dir_y[k] * forward_.y +
                           packet.dir_z[k] * forward_.z;
    }
  }
  shade(inputs_, packet, valid_, traced.colors, rays);
  if (is_cut_) note_cut();
  finish(packet, forward_, source_.exposure, traced);
  if (source_.falloff) fall_off(corner_x_, corner_y_, slope_, traced);
  return rays;
}

void BlockTracer::note_cut() noexcept {
  const bool by_chance = source_.illumination == Illumination::global;
  traced_ += 1.0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (valid_[k] == 0) continue;
    const double cut = std::min(1.0, double{cut_[k]});  // of values clipped to [0,1]
    if (by_chance) {
      cut_sums_[k] += cut;
    } else {
      cut_squares_ += cut * cut;
    }
  }
}

double BlockTracer::cut_squares() const noexcept {
  double squares = cut_squares_;
  for (const double sum : cut_sums_) squares += traced_ > 0.0 ? sum * sum / traced_ : 0.0;
  return squares;
}

FSTOP_KERNEL float BlockTracer::least_defocus(const TracedPacket& traced) const noexcept {
  const auto focus = static_cast<float>(frame_.vergence);
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < kLanes; ++k) {
    const float off = std::abs(focus - 1.0F / traced.depth[k]);
    least = valid_[k] != 0 && off < least ? off : least;
  }
  const bool may_be_sharp = source_.scene.branches() || source_.scene.has_screen_maps();
  return may_be_sharp && meets_sharp() ? 0.0F : least;
}

bool BlockTracer::meets_sharp() const noexcept {
  const bool follows_branches = source_.illumination != Illumination::local;
  const Scene& scene = source_.scene.scene();
  for (std::size_t k = 0; k < kLanes; ++k) {
    if (valid_[k] == 0 || packet_.object[k] == kNoHit) continue;
    const auto material = static_cast<std::size_t>(scene.objects[packet_.object[k]].material);
    const Material& m = scene.materials[material];
    if (follows_branches && (m.reflection > 0.0 || m.transmission > 0.0)) return true;
    if (source_.scene.is_on_screen(packet_.object[k])) return true;
  }
  return false;
}

FSTOP_KERNEL std::uint64_t BlockTracer::sum_any(std::uint32_t first, std::uint32_t count,
                                                BlockSums& sums) noexcept {
  std::uint64_t rays = 0;
  TracedPacket traced;
  float least = sums.least_defocus;
  for (std::uint32_t done = 0; done < count; done += kLanes) {
    PartialSums partial;
    const std::uint32_t end = std::min<std::uint32_t>(done + kLanes, count);
    for (std::uint32_t i = done; i < end; ++i) {
      rays += trace_any(first + i, traced);
      least = std::min(least, least_defocus(traced));
      add(traced.colors, partial);
    }
    for (std::size_t k = 0; k < kLanes; ++k) {
      sums.value[0][k] += static_cast<double>(partial.r[k]);
      sums.value[1][k] += static_cast<double>(partial.g[k]);
      sums.value[2][k] += static_cast<double>(partial.b[k]);
    }
  }
  sums.least_defocus = least;
  return rays;
}

// The whole way of a sample is compiled for one width of vectors: a wide load of what was stored
// in halves waits for both to reach the cache.
FSTOP_AVX512 std::uint64_t BlockTracer::trace_wide(std::uint32_t index,
                                                   TracedPacket& traced) noexcept {
  return trace_any(index, traced);
}
FSTOP_AVX512 std::uint64_t BlockTracer::sum_wide(std::uint32_t first, std::uint32_t count,
                                                 BlockSums& sums) noexcept {
  return sum_any(first, count, sums);
}

std::uint64_t BlockTracer::trace_one(std::uint32_t index, TracedPacket& traced) noexcept {
  return has_avx512() ? trace_wide(index, traced) : trace_any(index, traced);
}
std::uint64_t BlockTracer::trace(std::uint32_t first, std::uint32_t count,
                                 BlockSums& sums) noexcept {
  return has_avx512() ? sum_wide(first, count, sums) : sum_any(first, count, sums);
}

}  // namespace fstop
