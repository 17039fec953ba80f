// Complete samples per second and core beside bare rtcIntersect1 on the same rays, in one run:
// pairs of runs in turn, so that both see the same machine.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include <embree3/rtcore.h>

#include "core/render/sample_loop.h"
#include "tests/bench/bench_scenes.h"

namespace fstop {
namespace {

constexpr int kPairs = 7;
constexpr int kWidth = 960;
constexpr int kHeight = 640;
constexpr std::uint32_t kSamples = 16;  // a pixel; every kRowStep-th row is rendered
constexpr int kRowStep = 16;

CameraSpec bench_camera() {
  CameraSpec camera;
  camera.optics = LensSpec{.lens = {.focal_length = Length::si(0.05), .f_number = 1.4},
                           .focus_distance = Length::si(2.0)};
  return camera;
}

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// One thread's complete samples over a spread of rows, as the tile loop calls them.
struct CompleteSamples {
  const SampleSource& source;
  std::uint64_t samples = 0;
  std::uint64_t rays = 0;
  float checksum = 0.0F;

  void run() {
    samples = 0;
    rays = 0;
    alignas(64) LaneMask valid = {};
    valid.fill(-1);
    for (int y = 0; y < kHeight; y += kRowStep) {
      for (int x = 0; x < kWidth; ++x) {
        SampleKeys keys;
        keys.pixel.fill(static_cast<std::uint32_t>(y * kWidth + x));
        for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = i;
        TracedPacket traced;
        rays += trace_packet(source, keys, valid, traced);
        checksum += traced.colors.r[0];
        samples += kSamples;
      }
    }
  }
};

// The same rays, made before, through rtcIntersect1 and nothing else.
class BareRays {
 public:
  BareRays(const SampleSource& source, const Scene& scene)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (const Object& object : scene.objects) add(std::get<MeshObject>(object.shape).mesh);
    rtcCommitScene(scene_);
    make_rays(source);
  }
  ~BareRays() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareRays(const BareRays&) = delete;
  BareRays& operator=(const BareRays&) = delete;

  void run() {
    for (const Ray& ray : rays_) {
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      RTCRayHit hit = {};
      hit.ray.org_x = static_cast<float>(ray.origin.x);
      hit.ray.org_y = static_cast<float>(ray.origin.y);
      hit.ray.org_z = static_cast<float>(ray.origin.z);
      hit.ray.dir_x = static_cast<float>(ray.direction.x);
      hit.ray.dir_y = static_cast<float>(ray.direction.y);
      hit.ray.dir_z = static_cast<float>(ray.direction.z);
      hit.ray.tfar = kFar;
      hit.ray.mask = 0xffffffffU;
      hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene_, &context, &hit);
      checksum_ += hit.ray.tfar < kFar ? hit.ray.tfar : 0.0F;
    }
  }
  std::size_t count() const { return rays_.size(); }

 private:
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

  void make_rays(const SampleSource& source) {
    for (int y = 0; y < kHeight; y += kRowStep) {
      for (int x = 0; x < kWidth; ++x) {
        SampleKeys keys;
        keys.pixel.fill(static_cast<std::uint32_t>(y * kWidth + x));
        for (std::uint32_t i = 0; i < kLanes; ++i) keys.index[i] = i;
        LaneValues px, py, u = {}, v = {};
        source.sequence.fill(keys, Dimension::pixel_x, px);
        source.sequence.fill(keys, Dimension::pixel_y, py);
        if (source.samples_pupil) {
          source.sequence.fill(keys, Dimension::lens_u, u);
          source.sequence.fill(keys, Dimension::lens_v, v);
          source.pupil.apply(u, v);
        }
        for (std::size_t i = 0; i < kLanes; ++i) {
          rays_.push_back(std::visit(
              [&](const auto& camera) {
                return camera.ray({x + px[i], y + py[i]}, {u[i], v[i]});
              },
              source.camera));
        }
      }
    }
  }

  RTCDevice device_;
  RTCScene scene_;
  std::vector<Ray> rays_;
  float checksum_ = 0.0F;
};

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

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
  BareRays bare(source, ray_scene.scene());
  complete.run();
  bare.run();
  std::vector<double> sample_ns, bare_ns, ratios;
  for (int i = 0; i < kPairs; ++i) {
    const double a = seconds_of([&] { complete.run(); });
    const double b = seconds_of([&] { bare.run(); });
    sample_ns.push_back(1e9 * a / static_cast<double>(complete.samples));
    bare_ns.push_back(1e9 * b / static_cast<double>(bare.count()));
    const double rays = static_cast<double>(complete.rays);
    ratios.push_back((rays / a) / (static_cast<double>(bare.count()) / b));
  }
  std::printf("%-22s %8.2f %9.1f %12.2f %10.2f %8.0f %% %6.0f %%\n", label.c_str(),
              1e3 / median(sample_ns), median(sample_ns), 1e3 / median(bare_ns),
              static_cast<double>(complete.rays) / static_cast<double>(complete.samples),
              100.0 * median(ratios), 100.0 * *std::ranges::min_element(ratios));
}

}  // namespace
}  // namespace fstop

int main() {
  using namespace fstop;
  std::printf(
      "One thread; medians of %d pairs of runs in turn. The ratio is the complete\n"
      "samples' rays (shadow rays counted) per second over bare rtcIntersect1's.\n\n",
      kPairs);
  std::printf("%-22s %8s %9s %12s %10s %10s %8s\n", "", "Msample", "ns per", "rtcIntersect1",
              "rays per", "ratio", "least");
  std::printf("%-22s %8s %9s %12s %10s %10s %8s\n", "", "/s", "sample", "Mray/s", "sample",
              "median", "ratio");
  compare("slats unlit pinhole", bench_slats(), false);
  compare("slats unlit lens", bench_slats(), true);
  compare("mesh unlit pinhole", bench_mesh(ShadingModel::unlit), false);
  compare("mesh unlit lens", bench_mesh(ShadingModel::unlit), true);
  compare("mesh phong pinhole", bench_mesh(ShadingModel::phong), false);
  compare("mesh phong lens", bench_mesh(ShadingModel::phong), true);
  return 0;
}
