// Equal requests give equal pictures and equal errors, whatever the threads, by every method.
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/method.h"
#include "tests/methods/random_shots.h"

namespace fstop {
namespace {

Photograph photograph(const SimulationSpec& spec, const RayScene& scene, int threads) {
  WorkerPool workers(threads);
  return simulate(spec, scene, {.workers = &workers});
}

bool equal(const ImageError& a, const ImageError& b) {
  return a.estimate == b.estimate && a.upper_95 == b.upper_95 && a.energy == b.energy &&
         a.energy_upper_95 == b.energy_upper_95;
}

// A shot of every kind: found among the first seeds by what their lines say.
std::vector<RandomShot> shots() {
  std::vector<RandomShot> found;
  for (const char* kind :
       {"bars", "mirror", "sheet", "glass", "points", "area light", "motion", "hole"}) {
    for (std::uint32_t seed = 7000; seed < 7200; ++seed) {
      RandomShot shot = random_shot(seed);
      if (shot.what.find(kind) == std::string::npos) continue;
      shot.spec.quality.max_error = 0.02;
      shot.spec.outputs = {Output::color, Output::variance};
      found.push_back(std::move(shot));
      break;
    }
  }
  return found;
}

TEST(Repeats, EveryMethodGivesTheSameBytesByOneToFourThreads) {
  int compared = 0;
  for (RandomShot& shot : shots()) {
    const RayScene scene(std::move(shot.scene));
    for (const RenderMethod* method : render_methods()) {
      shot.spec.quality.method = method->name();
      // Waves need pixels as small as they are.
      shot.spec.effects.diffraction =
          method->name() == "wave" ? EffectChoice::on : EffectChoice::off;
      Photograph one;
      try {
        one = photograph(shot.spec, scene, 1);
      } catch (const Error& error) {
        ASSERT_EQ(error.code(), ErrorCode::no_valid_method) << error.what();
        continue;
      }
      ++compared;
      for (const int threads : {1, 2, 3, 4}) {
        const Photograph again = photograph(shot.spec, scene, threads);
        const std::string where = std::string(method->name()) + ", seed " +
                                  std::to_string(shot.seed) + ", " + std::to_string(threads) +
                                  " threads";
        EXPECT_TRUE(one.color == again.color) << where;
        EXPECT_TRUE(one.layers == again.layers) << where;
        EXPECT_TRUE(equal(one.report.error, again.report.error)) << where;
        EXPECT_EQ(one.report.cost.rays, again.report.cost.rays) << where;
      }
    }
  }
  EXPECT_GE(compared, 16) << "too few methods take these shots";
}

}  // namespace
}  // namespace fstop
