#include "core/render/bokeh_splatting.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <vector>

#include "core/render/emitter_sampler.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

// Points of a chunk: what one thread traces between two looks at the list of chunks.
constexpr std::uint32_t kChunk = 4096;
// Points whose splats are kept before they are added up in order: 8 MB of memory.
constexpr std::uint32_t kBatch = 128 * kChunk;
constexpr std::uint32_t kLooksForStop = 32;  // packets
// Coordinates round to single precision on both ends of a ray: about 60 roundings of 2^-24.
constexpr double kRelativeError = 4e-6;
constexpr std::uint32_t kSplatStream = 0x62a7c3d1U;  // apart from those of camera rays

struct Splat {
  std::uint32_t pixel = 0;
  std::array<float, 3> light = {};
};

// Sums of a chunk, and the splats that make it up.
struct ChunkLight {
  std::vector<Splat> splats = {};
  std::vector<SharpSplat> sharp = {};  // instead, where they are handed on
  double seen_px = 0.0;
  double reached_px = 0.0;
  std::uint64_t rays = 0;
};

// Sixteen points on their way from the emitter to the film.
struct SplatLanes {
  LaneValues lens_x = {};  // metres
  LaneValues lens_y = {};
  LaneValues time = {};
  LaneValues raster_x = {};
  LaneValues raster_y = {};
  EmitterPoints points = {};
  alignas(64) LaneMask visible = {};
};

// What lies behind an emitter changes the picture by little beside its own light: one packet of so
// many sees it for all. Of n independent points the emitter leaves an error of v/sqrt(n), up to
// white behind it one of sqrt(k - 1)/sqrt(n): with k = v/4 at most an eighth of that.
std::uint32_t packets_per_look(float exposure, const Rgb& radiance) {
  constexpr float kMostPackets = 8.0F;
  const float value = exposure * *std::ranges::max_element(radiance);
  return std::bit_floor(static_cast<std::uint32_t>(std::clamp(0.25F * value, 1.0F, kMostPackets)));
}

class EmitterSplatter {
 public:
  EmitterSplatter(const SplatSource& source, const FilmProjection& film,
                  const SplattedEmitter& splatted, std::uint32_t replicate, bool sharp)
      : source_(source),
        film_(film),
        splatted_(splatted),
        emitter_(source.scene.emitters()[splatted.number]),
        sampler_(source.scene, emitter_, film),
        sequence_(hash_of(source.seed, kSplatStream + replicate)),
        forward_(to_float(film.world_from_camera.forward())),
        sharp_(sharp) {
    const Scene& scene = source.scene.scene();
    const Object& object = scene.objects[emitter_.object];
    const Material& material = scene.materials[static_cast<std::size_t>(object.material)];
    is_plain_ = material.model == ShadingModel::unlit && material.emission.texture < 0;
    if (!sharp) behind_every_ = packets_per_look(source.exposure, emitter_.radiance);
    looks_key_ = hash_of(hash_of(source.seed, kSplatStream + replicate), splatted.number);
    footprint_rate_ = static_cast<float>(static_cast<double>(source.texture_width_px) / film.scale);
  }

  void trace(std::uint32_t first, std::uint32_t count, ChunkLight& chunk,
             const RunControl& run) const {
    for (std::uint32_t begin = 0; begin < count; begin += kLanes) {
      if (begin / kLanes % kLooksForStop == 0 && run.stop.stop_requested()) return;
      SampleKeys keys;
      keys.pixel.fill(splatted_.number);
      for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = first + begin + i;
      trace_packet(keys, static_cast<int>(std::min<std::uint32_t>(kLanes, count - begin)), chunk);
    }
  }

 private:
  void trace_packet(const SampleKeys& keys, int lanes, ChunkLight& chunk) const {
    SplatLanes splats;
    choose(keys, splats);
    bool any = false;
    for (std::size_t k = 0; k < static_cast<std::size_t>(lanes); ++k) {
      const double weight = splats.points.weight_px[k];
      chunk.seen_px += weight;
      const bool inside = splats.raster_x[k] >= 0.0 && splats.raster_y[k] >= 0.0 &&
                          splats.raster_x[k] < film_.width && splats.raster_y[k] < film_.height;
      splats.visible[k] = weight > 0.0 && inside ? -1 : 0;
      any = any || splats.visible[k] != 0;
    }
    if (!any) return;
    RayPacket without;
    aim(splats, without);
    // By chance: every n-th packet of a net would see the same slivers of the pupil for ever.
    const bool looks = hash_of(looks_key_, keys.index[0] / kLanes) % behind_every_ == 0;
    if (!looks) {
      find_hidden(without, splats, chunk);
    } else {
      find_visible(without, splats, chunk);
    }
    if (std::ranges::all_of(splats.visible, [](std::int32_t lane) { return lane == 0; })) return;
    FilmPlaces film(film_.width, film_.height, source_.texture_width_px);
    for (std::size_t k = 0; k < kLanes; ++k) {
      film.set(k, static_cast<float>(splats.raster_x[k]), static_cast<float>(splats.raster_y[k]));
    }
    const ShadingInputs inputs{.scene = source_.scene,
                               .sequence = sequence_,
                               .keys = keys,
                               .footprint_rate = footprint_rate_,
                               .film = &film,
                               .without_background = source_.hides_background ? kAllLanes : 0U,
                               .illumination = source_.illumination};
    LaneColors behind;
    if (looks) {
      shade(inputs, without, splats.visible, behind, chunk.rays);
      const auto packets = static_cast<float>(behind_every_);
      for (LaneFloats* channel : {&behind.r, &behind.g, &behind.b}) {
        for (float& value : *channel) value *= packets;
      }
    }
    const LaneColors emitted = emission(inputs, without, splats, chunk);
    lay_down(splats, without, emitted, behind, chunk);
  }

  void choose(const SampleKeys& keys, SplatLanes& splats) const {
    sequence_.fill(keys, Dimension::lens_u, splats.lens_x);
    sequence_.fill(keys, Dimension::lens_v, splats.lens_y);
    source_.pupil.apply(splats.lens_x, splats.lens_y);
    for (double& x : splats.lens_x) x *= film_.pupil_radius;
    for (double& y : splats.lens_y) y *= film_.pupil_radius;
    LaneValues u, v;
    sequence_.fill(keys, Dimension::pixel_x, u);
    sequence_.fill(keys, Dimension::pixel_y, v);
    EmitterPoints& points = splats.points;
    sampler_.sample(splats.lens_x, splats.lens_y, u, v, points);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Vec2 raster =
          film_.raster({points.x[k], points.y[k], points.z[k]}, splats.lens_x[k], splats.lens_y[k]);
      splats.raster_x[k] = raster.x;
      splats.raster_y[k] = raster.y;
    }
    if (source_.shutter_seconds > 0.0F) {
      sequence_.fill(keys, Dimension::time, splats.time);
      for (double& t : splats.time)
        t *= static_cast<double>(source_.shutter_seconds) / kLongestShutter;
    }
  }

  void aim(const SplatLanes& splats, RayPacket& packet) const {
    const EmitterPoints& points = splats.points;
    for (int i = 0; i < kLanes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Vec3 lens{splats.lens_x[k], splats.lens_y[k], 0.0};
      const Vec3 ray = Vec3{points.x[k], points.y[k], points.z[k]} - lens;
      const Vec3 direction = film_.world_from_camera.vector(ray * (1.0 / points.distance[k]));
      packet.set(i, to_float(film_.world_from_camera.point(lens)), to_float(direction), kFar,
                 static_cast<float>(splats.time[k]));
      packet.mask[k] = source_.choice.camera_mask;
    }
  }

  // The length of a lane's way on which something may hide its point: up to the point, less what
  // roundings may move a hit by.
  static float free_way(const RayPacket& packet, std::size_t k, double distance) {
    const Vec3f eye = packet.origin(static_cast<int>(k));
    const double largest = std::max({std::abs(eye.x), std::abs(eye.y), std::abs(eye.z)});
    return static_cast<float>(distance - kRelativeError * (largest + distance));
  }

  // Leaves those lanes visible whose point nothing lies before.
  void find_hidden(RayPacket& packet, SplatLanes& splats, ChunkLight& chunk) const {
    RayPacket shadow = packet;
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (splats.visible[k] == 0) continue;
      ++chunk.rays;
      shadow.far[k] = free_way(packet, k, splats.points.distance[k]);
    }
    source_.scene.occlude(shadow, splats.visible, Coherence::coherent);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (shadow.far[k] < 0.0F) splats.visible[k] = 0;
      any = any || splats.visible[k] != 0;
    }
    if (any && splatted_.may_be_hidden) find_emitters_before(packet, splats, chunk);
  }

  // The same; `without` gets what camera rays
  // see in its place.
  void find_visible(RayPacket& without, SplatLanes& splats, ChunkLight& chunk) const {
    source_.scene.intersect(without, splats.visible, Coherence::coherent);
    bool any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (splats.visible[k] == 0) continue;
      ++chunk.rays;
      const float way = free_way(without, k, splats.points.distance[k]);
      if (without.hit(static_cast<int>(k)) && without.far[k] < way) splats.visible[k] = 0;
      any = any || splats.visible[k] != 0;
    }
    if (any && splatted_.may_be_hidden) find_emitters_before(without, splats, chunk);
  }

  void find_emitters_before(const RayPacket& without, SplatLanes& splats, ChunkLight& chunk) const {
    RayPacket shadow;
    for (int i = 0; i < kLanes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      // A sphere does not hide its own point: near the rim its hit may be far off by roundings.
      const double distance = emitter_.triangles.empty()
                                  ? sampler_.nearest(splats.lens_x[k], splats.lens_y[k])
                                  : splats.points.distance[k];
      shadow.set(i, without.origin(i), without.direction(i), free_way(without, k, distance),
                 without.time[k]);
      shadow.mask[k] = source_.choice.splat_mask();
      chunk.rays += splats.visible[k] != 0 ? 1U : 0U;
    }
    source_.scene.occlude(shadow, splats.visible, Coherence::coherent);
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (shadow.far[k] < 0.0F) splats.visible[k] = 0;
    }
  }

  // What leaves the points towards the pupil: shaded as a camera ray's hit there would be.
  LaneColors emission(const ShadingInputs& inputs, const RayPacket& without,
                      const SplatLanes& splats, ChunkLight& chunk) const {
    LaneColors colors;
    if (is_plain_) {
      for (int i = 0; i < kLanes; ++i) colors.set(i, emitter_.radiance);
      return colors;
    }
    RayPacket hits = without;
    for (std::size_t k = 0; k < kLanes; ++k) {
      hits.far[k] = static_cast<float>(splats.points.distance[k]);
      hits.object[k] = emitter_.object;
    }
    hits.primitive = splats.points.primitive;
    hits.u = splats.points.b1;
    hits.v = splats.points.b2;
    shade(inputs, hits, splats.visible, colors, chunk.rays);
    return colors;
  }

  void lay_down(const SplatLanes& splats, const RayPacket& without, const LaneColors& emitted,
                const LaneColors& behind, ChunkLight& chunk) const {
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (splats.visible[k] == 0) continue;
      const Vec2 raster{splats.raster_x[k], splats.raster_y[k]};
      double factor = splats.points.weight_px[k];
      chunk.reached_px += factor;
      factor *= static_cast<double>(source_.exposure);
      if (source_.falloff) {
        factor *= std::visit([&](const auto& any) { return any.falloff(raster); }, source_.camera);
      }
      const auto scale = static_cast<float>(factor);
      if (sharp_) {
        const auto lane = static_cast<int>(k);
        const Rgb light = emitted.get(lane);
        const Rgb hidden = behind.get(lane);
        chunk.sharp.push_back(
            {.raster_x = static_cast<float>(raster.x),
             .raster_y = static_cast<float>(raster.y),
             .depth = static_cast<float>(splats.points.z[k]),
             .depth_behind =
                 without.hit(lane) ? without.far[k] * dot(without.direction(lane), forward_) : kFar,
             .light = {scale * light[0], scale * light[1], scale * light[2]},
             .hidden = {scale * hidden[0], scale * hidden[1], scale * hidden[2]}});
        continue;
      }
      const auto pixel = static_cast<std::uint32_t>(static_cast<int>(raster.y) * film_.width +
                                                    static_cast<int>(raster.x));
      chunk.splats.push_back(
          {.pixel = pixel,
           .light = {scale * (emitted.r[k] - behind.r[k]), scale * (emitted.g[k] - behind.g[k]),
                     scale * (emitted.b[k] - behind.b[k])}});
    }
  }

  const SplatSource& source_;
  const FilmProjection& film_;
  const SplattedEmitter& splatted_;
  const Emitter& emitter_;
  EmitterSampler sampler_;
  SampleSequence sequence_;
  Vec3f forward_;
  bool sharp_;
  bool is_plain_ = false;
  std::uint32_t behind_every_ = 1;  // one packet of so many looks at what lies behind, for all
  std::uint32_t looks_key_ = 0;
  float footprint_rate_ = 0.0F;
};

struct Chunk {
  std::size_t range = 0;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

std::vector<Chunk> chunks_of(std::span<const SplatRange> ranges) {
  std::vector<Chunk> chunks;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    for (std::uint32_t begin = 0; begin < ranges[i].count; begin += kChunk) {
      chunks.push_back({.range = i,
                        .first = ranges[i].first + begin,
                        .count = std::min(kChunk, ranges[i].count - begin)});
    }
  }
  return chunks;
}

void add_up(const ChunkLight& chunk, const SplatRange& range, SplatImage& light,
            SplatTotals& totals) {
  const double share = 1.0 / range.count;
  for (const Splat& splat : chunk.splats) {
    double* const pixel = light.at(splat.pixel);
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = share * static_cast<double>(splat.light[c]);
      pixel[c] += range.weight * value;
      totals.light[c] += value;
    }
  }
  totals.seen_px += share * chunk.seen_px;
  totals.reached_px += share * chunk.reached_px;
}

// Traces all ranges, batch by batch; calls finish(chunk's light, its range) in order, so that sums
// do not depend on which thread was first.
template <typename Finish>
std::uint64_t trace_ranges(const SplatSource& source, std::uint32_t replicate,
                           std::span<const SplatRange> ranges, bool sharp, const RunControl& run,
                           const Finish& finish) {
  const FilmProjection film(source.camera);
  const std::vector<Chunk> chunks = chunks_of(ranges);
  std::vector<ChunkLight> lights;
  std::uint64_t rays = 0;
  for (std::size_t begin = 0; begin < chunks.size();) {
    std::size_t end = begin;
    for (std::uint32_t points = 0; end < chunks.size() && points < kBatch; ++end) {
      points += chunks[end].count;
    }
    const std::size_t first_range = chunks[begin].range;
    std::vector<std::unique_ptr<EmitterSplatter>> splatters;
    for (std::size_t range = first_range; range <= chunks[end - 1].range; ++range) {
      const SplattedEmitter& emitter = source.choice.emitters[ranges[range].emitter];
      splatters.push_back(
          std::make_unique<EmitterSplatter>(source, film, emitter, replicate, sharp));
    }
    lights.assign(end - begin, {});
    parallel_for(run, static_cast<int>(end - begin), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      const Chunk& chunk = chunks[begin + k];
      splatters[chunk.range - first_range]->trace(chunk.first, chunk.count, lights[k], run);
    });
    throw_if_stopped(run);
    for (std::size_t i = begin; i < end; ++i) {
      finish(lights[i - begin], chunks[i].range);
      rays += lights[i - begin].rays;
    }
    begin = end;
  }
  return rays;
}

}  // namespace

Image image_of(const SplatImage& light) {
  Image image(light.width(), light.height(), 3);
  std::ranges::transform(light.values(), image.pixels().begin(),
                         [](double value) { return static_cast<float>(value); });
  return image;
}

SplatSource splat_source(const SampleSource& rays, const EmitterChoice& choice,
                         std::uint32_t seed) {
  return {.scene = rays.scene,
          .camera = rays.camera,
          .choice = choice,
          .pupil = rays.pupil,
          .seed = seed,
          .falloff = rays.falloff,
          .exposure = rays.exposure,
          .shutter_seconds = rays.shutter_seconds,
          .texture_width_px = rays.texture_width_px,
          .illumination = rays.illumination,
          .hides_background = rays.hides_background};
}

std::uint64_t splat(const SplatSource& source, std::uint32_t replicate,
                    std::span<const SplatRange> ranges, SplatImage& light,
                    std::span<SplatTotals> totals, const RunControl& run) {
  return trace_ranges(
      source, replicate, ranges, false, run, [&](const ChunkLight& chunk, std::size_t range) {
        SplatTotals unwanted;
        add_up(chunk, ranges[range], light, totals.empty() ? unwanted : totals[range]);
      });
}

std::uint64_t splat_sharp(const SplatSource& source, std::uint32_t replicate,
                          std::span<const SplatRange> ranges, SharpSplatSink& sink,
                          const RunControl& run) {
  const auto scaled = [](Rgb color, float factor) {
    return Rgb{color[0] * factor, color[1] * factor, color[2] * factor};
  };
  return trace_ranges(
      source, replicate, ranges, true, run, [&](const ChunkLight& chunk, std::size_t range) {
        const auto share = static_cast<float>(ranges[range].weight / ranges[range].count);
        for (SharpSplat splat : chunk.sharp) {
          splat.light = scaled(splat.light, share);
          splat.hidden = scaled(splat.hidden, share);
          sink.add(splat);
        }
      });
}

}  // namespace fstop
