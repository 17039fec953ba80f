#include "tests/methods/random_shots.h"

#include <cmath>
#include <cstdio>
#include <numbers>

namespace fstop {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;

// Counter-based, so that no standard library's distribution changes the cases (Steele, Lea & Flood
// 2014: SplitMix64).
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ULL + 0x1234567ULL) {}

  double uniform(double low, double high) { return low + (high - low) * unit(); }
  double log_uniform(double low, double high) { return low * std::pow(high / low, unit()); }
  bool chance(double probability) { return unit() < probability; }
  int index(int count) { return static_cast<int>(unit() * count); }
  float grey(double low, double high) { return static_cast<float>(uniform(low, high)); }
  Rgb color(double low, double high) { return {grey(low, high), grey(low, high), grey(low, high)}; }

 private:
  double unit() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1p-53;
  }
  std::uint64_t state_;
};

Image checker(Draw& draw, int size) {
  const int squares = 2 << draw.index(5);
  const Rgb one = draw.color(0.0, 0.4);
  const Rgb other = draw.color(0.4, 1.0);
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const bool bright = ((x * squares / size + y * squares / size) & 1) != 0;
      for (std::size_t c = 0; c < 3; ++c) image.at(x, y)[c] = bright ? other[c] : one[c];
    }
  }
  return image;
}

Image noise(Draw& draw, int size) {
  const int grain = 1 << draw.index(4);
  Image image(size, size, 3);
  for (int y = 0; y < size; y += grain) {
    for (int x = 0; x < size; x += grain) {
      const Rgb color = draw.color(0.0, 1.0);
      for (int i = 0; i < grain * grain; ++i) {
        for (std::size_t c = 0; c < 3; ++c) image.at(x + i % grain, y + i / grain)[c] = color[c];
      }
    }
  }
  return image;
}

Image smooth(Draw& draw, int size) {
  const double waves_x = draw.uniform(0.5, 6.0);
  const double waves_y = draw.uniform(0.5, 6.0);
  Image image(size, size, 3);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double phase = 2.0 * std::numbers::pi * (waves_x * x + (c + 1) * waves_y * y) / size;
        image.at(x, y)[c] = static_cast<float>(0.5 + 0.4 * std::sin(phase));
      }
    }
  }
  return image;
}

// Ridges z = height sin, facing the camera: triangles with normals.
Mesh ridges(double side, double height, bool with_normals) {
  constexpr int kCells = 16;
  Mesh mesh;
  for (int j = 0; j <= kCells; ++j) {
    for (int i = 0; i <= kCells; ++i) {
      const double u = double(i) / kCells;
      const double v = double(j) / kCells;
      const double phase = 6.0 * std::numbers::pi * u;
      mesh.positions.push_back({static_cast<float>(side * (u - 0.5)),
                                static_cast<float>(side * (v - 0.5)),
                                static_cast<float>(height * std::sin(phase))});
      mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
      const double slope = height / side * 6.0 * std::numbers::pi * std::cos(phase);
      const Vec3 normal = normalized(Vec3{-slope, 0.0, 1.0});
      if (with_normals) {
        mesh.normals.push_back({static_cast<float>(normal.x), static_cast<float>(normal.y),
                                static_cast<float>(normal.z)});
      }
      if (i == kCells || j == kCells) continue;
      const auto a = static_cast<std::uint32_t>(j * (kCells + 1) + i);
      constexpr std::uint32_t kRow = kCells + 1;
      mesh.triangles.push_back({a, a + 1, a + kRow + 1});
      mesh.triangles.push_back({a, a + kRow + 1, a + kRow});
    }
  }
  return mesh;
}

// Builds a shot part by part; every part notes itself in `what`.
class Builder {
 public:
  explicit Builder(RandomShot& shot) : draw_(shot.seed), shot_(shot) {}

  void build() {
    camera();
    textures();
    lit_ = draw_.chance(0.6);
    walls();
    const int things = 1 + draw_.index(4);
    for (int i = 0; i < things; ++i) thing();
    if (draw_.chance(0.35)) bars();
    if (draw_.chance(0.2)) mirror();
    if (draw_.chance(0.15)) sheet();
    if (draw_.chance(0.2)) bright_points();
    if (lit_) lights();
    if (draw_.chance(0.15)) motion();
    SimulationSpec& spec = shot_.spec;
    spec.quality.max_error = draw_.log_uniform(0.003, 0.05);
    spec.effects.diffraction = draw_.chance(0.4) ? EffectChoice::automatic : EffectChoice::off;
    spec.effects.falloff = draw_.chance(0.1) ? EffectChoice::on : EffectChoice::off;
    spec.seed = shot_.seed;
  }

 private:
  void camera() {
    SimulationSpec& spec = shot_.spec;
    spec.width = kWidth;
    spec.height = kHeight;
    char text[96];
    if (draw_.chance(0.1)) {
      const double distance = draw_.uniform(0.03, 0.1);
      const double diameter = draw_.log_uniform(0.3e-3, 3e-3);
      spec.camera.optics =
          PinholeSpec{.image_distance = Length::si(distance), .diameter = Length::si(diameter)};
      std::snprintf(text, sizeof text, "hole %.2f mm at %.0f mm", 1e3 * diameter, 1e3 * distance);
      focus_ = 3.0;
    } else {
      const double focal = draw_.log_uniform(0.024, 0.135);
      const double f_number = draw_.log_uniform(1.4, 32.0);
      focus_ = draw_.log_uniform(8.0 * focal, 12.0);
      const bool infinite = draw_.chance(0.12);
      constexpr int kBlades[] = {0, 0, 0, 5, 6, 8};
      spec.camera.optics = LensSpec{
          .lens = {.focal_length = Length::si(focal), .f_number = f_number},
          .focus_distance = infinite ? kInfinitelyFar : Length::si(focus_),
          .aperture = {.blades = kBlades[draw_.index(6)], .rotation = draw_.uniform(0.0, 1.0)}};
      std::snprintf(text, sizeof text, "%.0f mm f/%.1f at %.2f m%s", 1e3 * focal, f_number, focus_,
                    infinite ? " (infinity)" : "");
    }
    shot_.what = text;
    spec.camera.breathing = !draw_.chance(0.2);
    const double from = draw_.uniform(-2.0, 2.0);
    spec.camera.position = {from, 0.5 * from, 1.0};
    spec.camera.look_at = {from + draw_.uniform(-0.2, 0.2), 0.5 * from + draw_.uniform(-0.2, 0.2),
                           0.0};
    half_width_ = 0.018 / sensor_distance(spec.camera).si();
    pose_ = Pose::looking_at(spec.camera.position, spec.camera.look_at, spec.camera.up);
  }

  // A point that the camera sees at (x, y), -1 to 1 over the frame's width, `depth` off.
  Vec3 seen_at(double x, double y, double depth) const {
    return pose_.point({x * half_width_ * depth, -y * half_width_ * depth, depth});
  }
  double pixel(double depth) const { return 2.0 * half_width_ * depth / kWidth; }
  Vec3 right() const { return pose_.vector({1.0, 0.0, 0.0}); }
  Vec3 up() const { return pose_.vector({0.0, -1.0, 0.0}); }
  Vec3 back() const { return -pose_.forward(); }

  void textures() {
    constexpr TextureFilter kFilters[] = {TextureFilter::mipmap,  TextureFilter::mipmap,
                                          TextureFilter::mipmap,  TextureFilter::bilinear,
                                          TextureFilter::nearest, TextureFilter::brute_force};
    for (int i = 0; i < 3; ++i) {
      const int size = 64 << draw_.index(4);
      const int kind = draw_.index(3);
      shot_.scene.textures.push_back({.name = "texture" + std::to_string(i),
                                      .filter = kFilters[draw_.index(6)],
                                      .image = kind == 0   ? checker(draw_, size)
                                               : kind == 1 ? noise(draw_, size)
                                                           : smooth(draw_, size)});
    }
  }

  int material(Material made) {
    shot_.scene.materials.push_back(std::move(made));
    return static_cast<int>(shot_.scene.materials.size()) - 1;
  }

  int surface() {
    ColorSource color = {.value = draw_.color(0.2, 1.0)};
    if (draw_.chance(0.6)) color = {.value = {1, 1, 1}, .texture = draw_.index(3)};
    if (!lit_ || draw_.chance(0.2)) return material({.emission = color});
    Material made{.model = draw_.chance(0.5) ? ShadingModel::phong : ShadingModel::blinn_phong,
                  .ambient = color,
                  .diffuse = color};
    if (draw_.chance(0.4)) {
      made.specular.value = {0.4F, 0.4F, 0.4F};
      made.shininess = draw_.log_uniform(5.0, 200.0);
    }
    return material(std::move(made));
  }

  void card(Vec3 centre, Vec3 across, Vec3 along, int made) {
    shot_.scene.objects.push_back(
        {.shape =
             QuadObject{
                 .corner = centre - across * 0.5 - along * 0.5, .edge_u = across, .edge_v = along},
         .material = made});
  }

  void walls() {
    shot_.scene.background = draw_.chance(0.5) ? draw_.color(0.0, 0.8) : Rgb{0, 0, 0};
    wall_ = draw_.log_uniform(1.5 * focus_, 8.0 * focus_);
    if (draw_.chance(0.8)) {
      const double side = 3.0 * half_width_ * wall_;
      const double lean = draw_.uniform(-0.5, 0.5);
      card(seen_at(0, 0, wall_), right() * side, (up() + back() * lean) * side, surface());
    }
    if (draw_.chance(0.4)) {  // a floor, seen at a grazing angle
      const double drop = draw_.uniform(0.2, 0.6) * half_width_ * focus_;
      card(seen_at(0, 0, wall_ * 0.5) - up() * drop, right() * (4.0 * half_width_ * wall_),
           back() * wall_, surface());
    }
  }

  void thing() {
    const double depth = draw_.log_uniform(0.5 * focus_, 0.9 * wall_);
    const Vec3 centre = seen_at(draw_.uniform(-0.7, 0.7), draw_.uniform(-0.5, 0.5), depth);
    const double size = draw_.uniform(0.1, 0.5) * half_width_ * depth;
    switch (draw_.index(3)) {
      case 0:
        card(centre, (right() + back() * draw_.uniform(-1.0, 1.0)) * size,
             (up() + right() * draw_.uniform(-0.5, 0.5)) * size, surface());
        return;
      case 1:
        shot_.scene.objects.push_back(
            {.shape = SphereObject{.center = centre, .radius = size / 2}, .material = surface()});
        return;
      default: {
        constexpr Interpolation kKinds[] = {Interpolation::flat, Interpolation::gouraud,
                                            Interpolation::phong};
        const Interpolation kind = kKinds[draw_.index(3)];
        MeshObject object{.file = "ridges",
                          .interpolation = kind,
                          .mesh = ridges(size, 0.1 * size, kind != Interpolation::flat)};
        for (auto& p : object.mesh.positions) {
          const Vec3f moved = to_float(centre + right() * p[0] + up() * p[1] + back() * p[2]);
          p = {moved.x, moved.y, moved.z};
        }
        for (auto& n : object.mesh.normals) {
          const Vec3f turned = to_float(right() * n[0] + up() * n[1] + back() * n[2]);
          n = {turned.x, turned.y, turned.z};
        }
        shot_.scene.objects.push_back({.shape = std::move(object), .material = surface()});
      }
    }
  }

  void bars() {
    const double depth = draw_.uniform(0.2, 0.6) * focus_;
    const double width = draw_.log_uniform(0.3, 5.0) * pixel(depth);
    const int count = 3 + draw_.index(10);
    const int made = surface();
    const double tilt = draw_.uniform(-0.5, 0.5);
    for (int i = 0; i < count; ++i) {
      card(seen_at(-0.8 + 1.6 * i / count, 0, depth), right() * width,
           (up() + right() * tilt) * (half_width_ * depth), made);
    }
    shot_.what += ", bars";
  }

  void mirror() {
    const double depth = draw_.uniform(0.6, 1.2) * focus_;
    const int made = material({.model = ShadingModel::phong,
                               .diffuse = {.value = {0.1F, 0.1F, 0.1F}},
                               .reflection = draw_.uniform(0.3, 0.9)});
    const double size = draw_.uniform(0.3, 0.8) * half_width_ * depth;
    const Vec3 centre = seen_at(draw_.uniform(-0.5, 0.5), 0, depth);
    if (draw_.chance(0.5)) {
      shot_.scene.objects.push_back(
          {.shape = SphereObject{.center = centre, .radius = size / 2}, .material = made});
    } else {
      card(centre, (right() + back() * 0.8) * size, up() * size, made);
    }
    shot_.what += ", mirror";
  }

  void sheet() {
    const double depth = draw_.uniform(0.4, 0.9) * focus_;
    const double size = draw_.uniform(0.3, 1.0) * half_width_ * depth;
    const Vec3 centre = seen_at(draw_.uniform(-0.5, 0.5), 0, depth);
    Material made{.emission = {.value = draw_.color(0.0, 0.3)},
                  .transmission = draw_.uniform(0.4, 0.9)};
    if (draw_.chance(0.4)) {
      made.ior = 1.5;
      shot_.scene.objects.push_back({.shape = SphereObject{.center = centre, .radius = size / 2},
                                     .material = material(std::move(made))});
      shot_.what += ", glass";
      return;
    }
    card(centre, right() * size, up() * size, material(std::move(made)));
    shot_.what += ", sheet";
  }

  void bright_points() {
    const float radiance = static_cast<float>(draw_.log_uniform(2.0, 60.0));
    const int made =
        material({.emission = {.value = {radiance, 0.9F * radiance, 0.7F * radiance}}});
    const int count = 3 + draw_.index(15);
    for (int i = 0; i < count; ++i) {
      const double depth = draw_.log_uniform(0.8 * focus_, 0.95 * wall_);
      shot_.scene.objects.push_back(
          {.shape = SphereObject{.center = seen_at(draw_.uniform(-0.95, 0.95),
                                                   draw_.uniform(-0.6, 0.6), depth),
                                 .radius = draw_.log_uniform(0.1, 0.8) * pixel(depth)},
           .material = made});
    }
    shot_.what += ", points of " + std::to_string(static_cast<int>(radiance));
  }

  void lights() {
    shot_.scene.ambient_light = draw_.color(0.05, 0.3);
    const double above = 1.5 * half_width_ * focus_;
    const Vec3 place = seen_at(draw_.uniform(-1.0, 1.0), 0, 0.6 * focus_) + up() * above;
    const Rgb intensity = draw_.color(0.3, 0.9);
    const int kind = draw_.index(4);
    if (kind == 0) {
      shot_.scene.lights.push_back(
          {.kind = DirectionalLight{.direction = pose_.forward() - up() - right() * 0.3},
           .intensity = intensity});
    } else if (kind == 1) {
      shot_.scene.lights.push_back({.kind = PointLight{.position = place}, .intensity = intensity});
    } else if (kind == 2) {
      shot_.scene.lights.push_back({.kind = SpotLight{.position = place,
                                                      .direction = seen_at(0, 0, focus_) - place,
                                                      .exponent = draw_.uniform(1.0, 20.0)},
                                    .intensity = intensity});
    } else {
      const double side = draw_.uniform(0.1, 0.8) * above;
      shot_.scene.lights.push_back(
          {.kind = AreaLight{.corner = place, .edge_u = right() * side, .edge_v = back() * side},
           .intensity = intensity});
      shot_.what += ", area light";
    }
  }

  void motion() {
    Object& object = shot_.scene.objects.back();
    shot_.spec.camera.shutter_seconds = 1.0 / 60.0;
    const double pixels = draw_.log_uniform(0.3, 10.0);
    object.velocity = right() * (pixels * pixel(focus_) * 60.0);
    shot_.what += ", motion";
  }

  Draw draw_;
  RandomShot& shot_;
  Pose pose_ = {};
  double focus_ = 2.0;       // metres; the lens may be focused at infinity all the same
  double wall_ = 6.0;        // metres
  double half_width_ = 0.3;  // of the frame, at 1 m
  bool lit_ = false;
};

}  // namespace

RandomShot random_shot(std::uint32_t seed) {
  RandomShot shot;
  shot.seed = seed;
  Builder(shot).build();
  return shot;
}

}  // namespace fstop
