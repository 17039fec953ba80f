// Complete samples per second and core beside Embree's bare coherent packets of the same rays, in
// one run. Both are timed block by block, 16 packets at a time, in passes in turn over the picture;
// of every block's times the least counts, so that other programs on the machine do not.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include <embree3/rtcore.h>

#include "core/render/block_tracer.h"
#include "core/render/sample_loop.h"
#include "tests/bench/bench_scenes.h"

namespace fstop {
namespace {

constexpr int kPasses = 9;
constexpr int kWidth = 960;
constexpr int kHeight = 640;
constexpr std::size_t kSamples = 16;  // a pixel
constexpr int kTileRowStep = 4;

CameraSpec bench_camera() {
  CameraSpec camera;
  camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = 1.4},
                           .focus_distance = Length::si(2.0)};
  return camera;
}

// Every fourth row of tiles, block by block in the order of the tile loop.
std::vector<std::size_t> spread_blocks(const BlockGrid& grid) {
  constexpr int kSide = kTile / kBlockSide;
  std::vector<std::size_t> blocks;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (row / kSide % kTileRowStep == 0) blocks.push_back(grid.index(column, row));
    }
  }
  const auto tile = [&](std::size_t block) {
    return grid.top(block) / kTile * grid.columns + grid.left(block) / kTile;
  };
  std::ranges::stable_sort(blocks, {}, tile);
  return blocks;
}

double now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

// What reading the clock twice takes, which no block's time contains.
double clock_seconds() {
  double least = 1.0;
  for (int i = 0; i < 1000; ++i) {
    const double start = now();
    least = std::min(least, now() - start);
  }
  return least;
}

// Seconds of every block, the least of all passes.
class BlockTimes {
 public:
  explicit BlockTimes(std::size_t count) : least_(count, 1e9) {}

  void keep(std::size_t i, double seconds) { least_[i] = std::min(least_[i], seconds); }
  double sum() const { return std::accumulate(least_.begin(), least_.end(), 0.0); }

 private:
  std::vector<double> least_;
};

// One thread's complete samples: sequence to sums.
struct CompleteSamples {
  const SampleSource& source;
  BlockGrid grid{kWidth, kHeight};
  std::vector<std::size_t> blocks = spread_blocks(grid);
  BlockTimes times{blocks.size()};
  double clock = clock_seconds();
  std::uint64_t samples = 0;
  std::uint64_t rays = 0;
  double checksum = 0.0;

  void pass() {
    samples = 0;
    rays = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      BlockSums sums;
      const double start = now();
      rays += BlockTracer(source, grid, blocks[i]).trace(0, kSamples, sums);
      times.keep(i, now() - start - clock);
      samples += kSamples * kLanes;
      checksum += sums.value[0][0];
    }
  }
};

// The same rays, and those from where they hit to the sun, through Embree's coherent packets and
// nothing else: packets are made some at a time, so that they lie in the cache, off the clock.
class BarePackets {
 public:
  BarePackets(const SampleSource& source, const Scene& scene)
      : source_(source), device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (const Object& object : scene.objects) add(std::get<MeshObject>(object.shape).mesh);
    rtcCommitScene(scene_);
    if (!scene.lights.empty() && scene.materials[0].model != ShadingModel::unlit) {
      const auto& sun = std::get<DirectionalLight>(scene.lights[0].kind);
      sun_ = normalized(-to_float(sun.direction));
      has_sun_ = true;
    }
  }
  ~BarePackets() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BarePackets(const BarePackets&) = delete;
  BarePackets& operator=(const BarePackets&) = delete;

  void pass(const CompleteSamples& samples, BlockTimes& times) {
    rays = 0;
    for (std::size_t i = 0; i < samples.blocks.size(); ++i) {
      make_packets(samples.grid, samples.blocks[i]);
      double seconds = time(samples.clock, [&](RTCIntersectContext& context) {
        for (RayPacket& p : packets_) {
          rtcIntersect16(all_.data(), scene_, &context, reinterpret_cast<RTCRayHit16*>(&p));
        }
      });
      if (has_sun_) {
        make_shadow_packets();
        seconds += time(samples.clock, [&](RTCIntersectContext& context) {
          for (std::size_t k = 0; k < kSamples; ++k) {
            rtcOccluded16(asked_[k].data(), scene_, &context,
                          reinterpret_cast<RTCRay16*>(&packets_[k]));
          }
        });
      }
      times.keep(i, seconds);
    }
  }
  std::uint64_t rays = 0;

 private:
  double time(double clock, const auto& work) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const double start = now();
    work(context);
    return now() - start - clock;
  }

  void add(const Mesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<std::array<float, 3>*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
    std::ranges::copy(mesh.positions, vertices);
    auto* indices = static_cast<std::array<std::uint32_t, 3>*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
    std::ranges::copy(mesh.triangles, indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

  void make_packets(const BlockGrid& grid, std::size_t block) {
    SampleKeys keys;
    keys.pixel.fill(static_cast<std::uint32_t>(block));
    for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = i;
    LaneValues u = {}, v = {};
    if (source_.samples_pupil) {
      source_.sequence.fill(keys, Dimension::lens_u, u);
      source_.sequence.fill(keys, Dimension::lens_v, v);
      source_.pupil.apply(u, v);
    }
    grid.for_each_pixel(block, [&](std::size_t lane, int x, int y) {
      keys.pixel.fill(static_cast<std::uint32_t>(y * kWidth + x));
      LaneValues px, py;
      source_.sequence.fill(keys, Dimension::pixel_x, px);
      source_.sequence.fill(keys, Dimension::pixel_y, py);
      for (std::size_t i = 0; i < kSamples; ++i) {
        const Ray ray = std::visit(
            [&](const auto& camera) {
              return camera.ray({x + px[i], y + py[i]}, {u[i], v[i]});
            },
            source_.camera);
        packets_[i].set(static_cast<int>(lane), to_float(ray.origin), to_float(ray.direction), kFar,
                        0.0F);
        ++rays;
      }
    });
  }

  void make_shadow_packets() {
    for (std::size_t i = 0; i < kSamples; ++i) {
      RayPacket& p = packets_[i];
      for (int lane = 0; lane < kLanes; ++lane) {
        const auto k = static_cast<std::size_t>(lane);
        Vec3f normal = normalized(Vec3f{p.normal_x[k], p.normal_y[k], p.normal_z[k]});
        if (dot(normal, p.direction(lane)) > 0.0F) normal = -normal;
        const bool lit = p.hit(lane) && dot(normal, sun_) > 0.0F;
        asked_[i][k] = lit ? -1 : 0;
        rays += lit ? 1U : 0U;
        const Vec3f at = p.origin(lane) + p.direction(lane) * p.far[k] + normal * 1e-5F;
        p.set(lane, at, sun_, kFar, 0.0F);
      }
    }
  }

  const SampleSource& source_;
  RTCDevice device_;
  RTCScene scene_;
  Vec3f sun_ = {};
  bool has_sun_ = false;
  alignas(64) LaneMask all_ = filled();
  std::array<RayPacket, kSamples> packets_ = {};
  std::array<LaneMask, kSamples> asked_ = {};

  static LaneMask filled() {
    LaneMask mask;
    mask.fill(-1);
    return mask;
  }
};

void compare(const std::string& label, Scene scene, bool through_lens) {
  const RayScene ray_scene(std::move(scene));
  const CameraSpec spec = bench_camera();
  const Sensor sensor = sensor_of(spec, kWidth, kHeight);
  const Camera camera =
      through_lens ? camera_of(spec, sensor) : Camera(central_projection(spec, sensor));
  const SampleSource source{.scene = ray_scene,
                            .camera = camera,
                            .sensor = sensor,
                            .pupil = PupilWarp({}),
                            .sequence = SampleSequence(0),
                            .samples_pupil = through_lens,
                            .texture_width_px = 0.25F};
  CompleteSamples complete{source};
  BarePackets bare(source, ray_scene.scene());
  BlockTimes bare_times(complete.blocks.size());
  for (int i = 0; i < kPasses; ++i) {
    complete.pass();
    bare.pass(complete, bare_times);
  }
  const auto samples = static_cast<double>(complete.samples);
  const double sample_ns = 1e9 * complete.times.sum() / samples;
  const double bare_ns = 1e9 * bare_times.sum() / samples;
  std::printf("%-22s %9.2f %9.1f %9.1f %9.3f %9.3f %8.2f\n", label.c_str(), 1e3 / sample_ns,
              sample_ns, bare_ns, static_cast<double>(complete.rays) / samples,
              static_cast<double>(bare.rays) / samples, sample_ns / bare_ns);
}

}  // namespace
}  // namespace fstop

// Arguments: none for all, or the beginning of a row's name.
int main(int argc, char** argv) {
  using namespace fstop;
  std::printf(
      "One thread; of every block of 16 x 16 samples the least of %d passes. The ratio is a\n"
      "complete sample's time over that of its rays alone, the shadow ray counted, in Embree's\n"
      "coherent packets of 16.\n\n",
      kPasses);
  std::printf("%-22s %9s %9s %9s %9s %9s %8s\n", "", "Msample", "ns per", "of rays", "rays per",
              "bare rays", "ratio");
  std::printf("%-22s %9s %9s %9s %9s %9s\n", "", "/s", "sample", "alone", "sample", "a sample");
  const std::string_view wanted = argc > 1 ? argv[1] : "";
  const auto row = [&](const std::string& label, Scene scene, bool through_lens) {
    if (label.starts_with(wanted)) compare(label, std::move(scene), through_lens);
  };
  row("slats unlit pinhole", bench_slats(), false);
  row("slats unlit lens", bench_slats(), true);
  row("mesh unlit pinhole", bench_mesh(ShadingModel::unlit), false);
  row("mesh unlit lens", bench_mesh(ShadingModel::unlit), true);
  row("mesh phong pinhole", bench_mesh(ShadingModel::phong), false);
  row("mesh phong lens", bench_mesh(ShadingModel::phong), true);
  return 0;
}
