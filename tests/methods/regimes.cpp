#include "tests/methods/regimes.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace fstop {
namespace {

constexpr int kCard = 0;  // materials
constexpr int kGlow = 1;
constexpr int kMirror = 2;
constexpr int kDim = 3;

// Squares of hard contrast with a little colour.
TextureSource checker(int squares) {
  constexpr int kSide = 256;
  TextureSource texture{.name = "checker", .image = Image(kSide, kSide, 3)};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool bright = ((x * squares / kSide + y * squares / kSide) & 1) != 0;
      texture.image.at(x, y)[0] = bright ? 0.9F : 0.1F;
      texture.image.at(x, y)[1] = bright ? 0.8F : 0.15F;
      texture.image.at(x, y)[2] = bright ? 0.7F : 0.3F;
    }
  }
  return texture;
}

SimulationSpec photo(double focal, double f_number, double focus) {
  SimulationSpec spec;
  spec.camera.optics =
      LensSpec{.lens = {.focal_length = Length::si(focal), .f_number = f_number},
               .focus_distance = std::isinf(focus) ? kInfinitelyFar : Length::si(focus)};
  return spec;
}

// A regime under way: its camera looks along -z from its position.
class Stage {
 public:
  Stage(std::string name, const SimulationSpec& spec, int squares = 16) {
    regime_.name = std::move(name);
    regime_.spec = spec;
    regime_.scene.textures = {checker(squares)};
    regime_.scene.materials = {
        Material{.name = "card", .emission = {.value = {1, 1, 1}, .texture = 0}},
        Material{.name = "glow", .emission = {.value = {0.9F, 0.9F, 0.8F}}},
        Material{.name = "mirror", .reflection = 0.9},
        Material{.name = "dim", .emission = {.value = {0.05F, 0.05F, 0.1F}}}};
    width_ = spec.camera.sensor_width.si() / sensor_distance(spec.camera).si();
  }

  double width_at(double depth) const { return width_ * depth; }
  Scene& scene() { return regime_.scene; }
  SimulationSpec& spec() { return regime_.spec; }

  // A card `frames` frames wide, its middle `across` frames to the right; `lean` metres of depth
  // per metre of height.
  Stage& card(double depth, double frames, double across = 0.0, int material = kCard,
              double lean = 0.0) {
    const double side = frames * width_at(depth);
    quad({across * width_at(depth) - side / 2, -side / 2, -depth + lean * side / 2}, {side, 0, 0},
         {0, side, -lean * side}, material);
    return *this;
  }
  // `count` upright bars, `pixels` of `of` pixels wide.
  Stage& bars(double depth, double pixels, int of, int count) {
    const double frame = width_at(depth);
    for (int i = 0; i < count; ++i) {
      const double x = frame * ((i + 0.5) / count - 0.5);
      quad({x, -frame, -depth}, {frame * pixels / of, 0, 0}, {0, 2 * frame, 0}, kGlow);
    }
    return *this;
  }
  Stage& quad(Vec3 corner, Vec3 u, Vec3 v, int material) {
    regime_.scene.objects.push_back(
        {.shape =
             QuadObject{.corner = regime_.spec.camera.position + corner, .edge_u = u, .edge_v = v},
         .material = material});
    return *this;
  }
  Stage& sphere(Vec3 center, double radius, int material) {
    regime_.scene.objects.push_back(
        {.shape = SphereObject{.center = regime_.spec.camera.position + center, .radius = radius},
         .material = material});
    return *this;
  }
  Regime done() { return std::move(regime_); }

 private:
  Regime regime_ = {};
  double width_ = 0.0;  // of the frame at 1 m
};

std::string numbered(const char* before, double value, const char* after) {
  char text[80];
  std::snprintf(text, sizeof text, "%s%g%s", before, value, after);
  return text;
}

void add_lenses(std::vector<Regime>& all) {
  const double far = std::numeric_limits<double>::infinity();
  all.push_back(Stage("macro 1:1", photo(0.1, 2.8, 0.2)).card(0.2, 2.0, 0.0, kCard, 0.5).done());
  all.push_back(
      Stage("focus at infinity", photo(0.05, 2.0, far)).card(50.0, 2.0).card(3.0, 0.4, 0.2).done());
  for (const double beyond : {0.5e-3, 1e-6}) {
    const double focus = 0.05 + beyond;
    all.push_back(Stage(numbered("focus ", 1e6 * beyond, " um outside f"), photo(0.05, 4.0, focus))
                      .card(focus, 2.0)
                      .card(2.0, 2.0)
                      .done());
  }
  for (const double f_number : {0.5, 1.0, 22.0, 256.0}) {
    all.push_back(Stage(numbered("f/", f_number, ""), photo(0.05, f_number, 2.0))
                      .card(4.0, 2.0)
                      .card(2.0, 0.4, -0.2)
                      .card(1.2, 0.2, 0.3, kGlow)
                      .done());
  }
}

// A card whose blur disc is `pixels` wide in a picture 96 pixels wide.
void add_blurs(std::vector<Regime>& all) {
  for (const double pixels : {0.1, 0.5, 1.0, 3.0, 10.0, 100.0, 500.0}) {
    const SimulationSpec spec = photo(0.05, 1.4, 2.0);
    const double pitch = spec.camera.sensor_width.si() / 96.0;
    const double pupil = 0.05 / 1.4;
    const double vergence =
        1.0 / 2.0 + pixels * pitch / (pupil * sensor_distance(spec.camera).si());
    all.push_back(
        Stage(numbered("blur of ", pixels, " px"), spec).card(1.0 / vergence, 4.0).done());
  }
}

void add_depths(std::vector<Regime>& all) {
  all.push_back(Stage("edge in depth", photo(0.05, 1.4, 1.0))
                    .card(8.0, 2.0)
                    .card(1.0, 2.0, -1.0, kGlow)
                    .done());
  all.push_back(Stage("thin bars near the lens", photo(0.05, 2.0, 4.0))
                    .card(4.0, 2.0)
                    .bars(0.4, 0.3, 96, 7)
                    .done());
  all.push_back(Stage("bars between the probe's rays", photo(0.05, 1.4, 4.0))
                    .card(4.0, 2.0, 0.0, kDim)
                    .bars(0.15, 0.05, 96, 5)
                    .done());
  Stage mirror("mirror of what is out of focus", photo(0.05, 1.4, 1.0));
  const double side = mirror.width_at(1.0);
  // In focus itself, it turns the view by a right angle to a card 4 m aside.
  mirror.quad({-side, -side, -1.0 + side}, {2 * side, 0, -2 * side}, {0, 2 * side, 0}, kMirror)
      .quad({4.0, -4.0, -5.0}, {0, 0, 8}, {0, 8, 0}, kCard);
  all.push_back(mirror.done());
}

void add_lights(std::vector<Regime>& all) {
  for (const double depth : {1.0, 10.0}) {
    Stage points(numbered("bright points at ", depth, " m, focus 2 m"), photo(0.05, 1.4, 2.0));
    points.card(20.0, 2.0, 0.0, kDim);
    const int bright = static_cast<int>(points.scene().materials.size());
    points.scene().materials.push_back({.name = "point", .emission = {.value = {500, 400, 300}}});
    const double frame = points.width_at(depth);
    for (int i = 0; i < 6; ++i) {
      points.sphere({frame * (0.14 * i - 0.35), frame * 0.2 * std::sin(2.0 * i), -depth},
                    0.15 * frame / 96, bright);
    }
    all.push_back(points.done());
  }
}

void add_scales(std::vector<Regime>& all) {
  SimulationSpec tiny = photo(2e-3, 2.0, 10e-3);
  tiny.camera.sensor_width = 1.2_mm;
  tiny.camera.sensor_height = 0.8_mm;
  all.push_back(Stage("scene of millimetres", tiny).card(20e-3, 2.0).card(8e-3, 0.4, 0.2).done());
  all.push_back(Stage("scene of kilometres", photo(0.4, 2.8, 2000.0))
                    .card(9000.0, 2.0)
                    .card(2000.0, 0.4, -0.2)
                    .card(300.0, 0.2, 0.3, kGlow)
                    .done());
  Stage floor("grazing floor", photo(0.035, 1.4, 3.0), 128);
  floor.quad({-20, -0.05, -40}, {40, 0, 0}, {0, 0, 39.7}, kCard);
  all.push_back(floor.done());
  SimulationSpec off = photo(0.05, 1.4, 2.0);
  off.camera.position = {70000.0, -66000.0, 80000.0};
  off.camera.look_at = {70000.0, -66000.0, 0.0};
  all.push_back(Stage("70 km off the origin", off).card(4.0, 2.0).card(2.0, 0.4, -0.2).done());
}

// Sizes that are the regime.
void add_pictures(std::vector<Regime>& all) {
  const auto sized = [](const char* name, int width, int height, double sensor_width,
                        double f_number = 1.4) {
    SimulationSpec spec = photo(0.05, f_number, 2.0);
    spec.width = width;
    spec.height = height;
    spec.camera.sensor_width = Length::si(sensor_width);
    spec.camera.sensor_height = Length::si(sensor_width * height / width);
    return Stage(name, spec).card(4.0, 20.0).card(2.0, 0.4, -0.2).done();
  };
  all.push_back(sized("one pixel", 1, 1, 0.024));
  all.push_back(sized("one column", 1, 61, 0.5e-3));
  all.push_back(sized("70,000 columns", 70000, 1, 0.35, 8.0));  // a scanner's line: 5 um a pixel
}

}  // namespace

std::vector<Regime> stability_regimes(int width, double max_error) {
  std::vector<Regime> all;
  add_lenses(all);
  add_blurs(all);
  add_depths(all);
  add_lights(all);
  add_scales(all);
  for (Regime& regime : all) {
    regime.spec.width = width;
    regime.spec.height = width * 2 / 3;
  }
  add_pictures(all);
  for (Regime& regime : all) regime.spec.quality.max_error = max_error;
  return all;
}

}  // namespace fstop
