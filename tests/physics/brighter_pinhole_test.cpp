// The bundled pair: a pinhole and a lens at the same image distance, exposed in the inverse ratio
// of their areas. The lens is a brighter pinhole: the same projection, the same picture of the
// focused plane; and unlike one, it blurs what lies elsewhere.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "api/render_request.h"
#include "core/render/simulation.h"

namespace fstop {
namespace {

struct Shown {
  SimulationSpec spec = {};
  Image picture = {};
};

Shown shown(const std::string& name) {
  std::ifstream file(std::string(FSTOP_SOURCE_DIR) + "/api/examples/" + name + ".json");
  std::stringstream text;
  text << file.rdbuf();
  const api::RenderRequest request =
      api::parse_render_request(text.str(), api::Limits{}, api::SceneNames::stored_only);
  WorkerPool workers(2);
  const RayScene scene(std::get<api::SceneDocument>(request.scene).scene);
  return {.spec = request.spec,
          .picture = simulate(request.spec, scene, {.workers = &workers}).color};
}

// The sum of green and its centroid, px, in a window about a mark, 31 px wide at (x, y).
struct Mark {
  double light = 0.0;
  double x = 0.0;
  double y = 0.0;
};
Mark mark_at(const Image& picture, int x, int y) {
  Mark mark;
  for (int j = y - 22; j < y + 22; ++j) {
    for (int i = x - 22; i < x + 22; ++i) {
      const auto value = double{picture.at(i, j)[1]};
      mark.light += value;
      mark.x += value * (i + 0.5);
      mark.y += value * (j + 0.5);
    }
  }
  mark.x /= mark.light;
  mark.y /= mark.light;
  return mark;
}

// Of the middle row, which crosses the edges of eight stripes at 8 m and the gaps between them:
// least and most green, and how many pixels lie between 10 and 90 % of the most.
struct Stripes {
  double least = 1e9;
  double most = 0.0;
  int soft = 0;
};
Stripes stripes_of(const Image& picture) {
  Stripes stripes;
  const auto value = [&](int x) { return double{picture.at(x, picture.height() / 2)[1]}; };
  for (int x = 35; x < picture.width() - 35; ++x) {
    stripes.least = std::min(stripes.least, value(x));
    stripes.most = std::max(stripes.most, value(x));
  }
  for (int x = 35; x < picture.width() - 35; ++x) {
    const double share = value(x) / stripes.most;
    stripes.soft += share > 0.1 && share < 0.9 ? 1 : 0;
  }
  return stripes;
}

TEST(BrighterPinhole, LensShowsTheFocusedPlaneAsAHoleDoesInTheInverseOfTheAreas) {
  const Shown hole = shown("brighter-pinhole-hole");
  const Shown lens = shown("brighter-pinhole-lens");
  const auto& of_hole = std::get<PinholeSpec>(hole.spec.camera.optics);
  const auto& of_lens = std::get<LensSpec>(lens.spec.camera.optics);
  const double diameter = of_lens.lens.focal_length.si() / of_lens.lens.f_number;
  EXPECT_NEAR(hole.spec.camera.shutter_seconds / lens.spec.camera.shutter_seconds,
              std::pow(diameter / of_hole.diameter.si(), 2), 1e-6);
  // 1/50 mm = 1/2 m + 1/v; a mark of 60 mm at x = 0.45 m, y = 0.28 m.
  const double v = 1.0 / (1.0 / 0.050 - 1.0 / 2.0);
  const double px_per_metre = v / 2.0 / (36e-3 / 480);
  const double side = 0.06 * px_per_metre;
  // ISO 100 and what the lens's working number v/D leaves: 8000 t/N^2 of the radiance 0.9.
  const double factor = 8000.0 * lens.spec.camera.shutter_seconds / std::pow(v / diameter, 2);
  const double light = 0.9 * factor * side * side;
  for (const int i : {-1, 1}) {
    for (const int j : {-1, 1}) {
      const double x = 240.0 + 0.45 * px_per_metre * i;
      const double y = 160.0 - 0.28 * px_per_metre * j;
      const auto column = static_cast<int>(std::lround(x));
      const auto row = static_cast<int>(std::lround(y));
      const Mark a = mark_at(hole.picture, column, row);
      const Mark b = mark_at(lens.picture, column, row);
      std::printf(
          "mark (%+d,%+d): hole %.2f at (%.3f, %.3f), lens %.2f at (%.3f, %.3f); expected "
          "%.2f at (%.3f, %.3f)\n",
          i, j, a.light, a.x, a.y, b.light, b.x, b.y, light, x, y);
      // The pictures' errors, at most 0.004 a pixel, where they arise: in the pixels of a mark's
      // outline, 4 x 21 of them and twice as many where a hole blurs by 0.7 px, independent:
      // sqrt(168) 0.004 sqrt(480 320/(4 168)) = 0.78 of a light of 370, 0.2 %; with arms of 11 px
      // that is 0.023 px of the centroid. Both in three standard errors.
      for (const Mark& mark : {a, b}) {
        EXPECT_NEAR(mark.light, light, 0.007 * light);
        EXPECT_NEAR(mark.x, x, 0.07);
        EXPECT_NEAR(mark.y, y, 0.07);
      }
    }
  }
  // At 8 m sixteen edges: the hole blurs them by 0.05 mm (1 + v/8 m), 0.7 px, which leaves at most
  // three soft pixels each; the lens by 25 mm v |1/2 m - 1/8 m| = 0.48 mm, 6.4 px, whose edge has
  // 0.69 of that between 10 and 90 %: 4.4 px.
  const Stripes bare = stripes_of(hole.picture);
  const Stripes blurred = stripes_of(lens.picture);
  for (const Stripes& stripes : {bare, blurred}) {
    EXPECT_NEAR(stripes.least, 0.0, 0.02);
    EXPECT_NEAR(stripes.most, 0.45 * factor, 0.02);
  }
  std::printf("soft pixels of 16 edges: hole %d, lens %d\n", bare.soft, blurred.soft);
  EXPECT_LE(bare.soft, 16 * 3);
  EXPECT_NEAR(blurred.soft, 16 * 4.4, 16.0);
}

}  // namespace
}  // namespace fstop
