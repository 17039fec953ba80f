// The bundled suite and its planted errors, rendered in this process; the false alarms of baselines
// over real seeds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "api/chart_photograph.h"
#include "api/verify_suite.h"
#include "core/study/image_baseline.h"
#include "tests/physics/test_scenes.h"

namespace fstop {
namespace {

/// Pictures as fstop verify has them where no server is named.
class HerePhotographer {
 public:
  Image operator()(const ChartShot& shot) {
    return api::picture_here(api::chart_request_text(shot), ".", store_, limits_,
                             {.workers = &workers_});
  }

 private:
  api::Limits limits_ = {};
  api::SceneStore store_ = {{}, limits_};
  WorkerPool workers_{2};
};

TEST(BundledSuite, IsGreen) {
  HerePhotographer camera;
  const api::VerifySuite suite = api::parse_verify_suite(api::default_suite_json(), {});
  int pictures = 0;
  for (const VerificationCheck& check : suite.checks) {
    const VerificationOutcome outcome =
        verified(check, [&](const ChartShot& shot) { return camera(shot); });
    std::printf("%s", verification_text(outcome).c_str());
    EXPECT_TRUE(outcome.holds()) << check.name;
    pictures += outcome.pictures;
  }
  std::printf("%d pictures\n", pictures);
}

TEST(BundledSuite, CatchesOnePercentInFocalLengthApertureAndWavelength) {
  HerePhotographer camera;
  const api::VerifySuite suite = api::parse_verify_suite(api::default_suite_json(), {});
  const std::vector<PlantedTrial> trials =
      planted_trials(suite.checks, 0.01, [&](const ChartShot& shot) { return camera(shot); }, {});
  ASSERT_EQ(trials.size(), 6U);
  for (const PlantedTrial& trial : trials) {
    std::printf("%s", trial_text(trial).c_str());
    EXPECT_TRUE(trial.is_caught());
  }
}

// Replicates of one scene, drawn anew for each trial from a pool of 400 seeds: 16 make the
// baseline, another one is compared. Trials share pictures of the pool, a little: of 400 trials
// the block's and the picture's rate p show within 4 sqrt(p (1 - p) n); beyond once in 16,000 where
// trials are independent. Pixels alarm at most as often as is said.
TEST(BaselineRate, RealNoiseAlarmsFalselyAsOftenAsItSays) {
  constexpr int kPool = 400;
  constexpr int kTrials = 400;
  constexpr int kReplicates = 16;
  constexpr double kRate = 0.15;
  SimulationSpec shot = lens_shot(1.4, 37.5_um, 48, 32);
  shot.quality.method = "lens-sampling";
  shot.quality.samples = 32;
  shot.effects.diffraction = EffectChoice::off;
  const RayScene scene(
      glowing_scene({glowing_square(shot, 4.0_m, 18.0),
                     glowing_quad({-0.1, -0.08, -8.0}, {0.12, 0.02, 0.0}, {0.02, 0.1, 0.0})}));
  WorkerPool workers(2);
  std::vector<Image> pool;
  for (int seed = 1; seed <= kPool; ++seed) {
    shot.seed = static_cast<std::uint32_t>(seed);
    pool.push_back(simulate(shot, scene, {.workers = &workers}).color);
  }
  std::mt19937 random(1);
  std::vector<int> order(kPool);
  for (int i = 0; i < kPool; ++i) order[static_cast<std::size_t>(i)] = i;
  int pixels = 0, blocks = 0, whole = 0, all = 0;
  for (int i = 0; i < kTrials; ++i) {
    std::ranges::shuffle(order, random);
    BaselineBuilder builder;
    for (int k = 1; k <= kReplicates; ++k)
      builder.add(pool[static_cast<std::size_t>(order[static_cast<std::size_t>(k)])]);
    const BaselineVerdict verdict =
        compared(pool[static_cast<std::size_t>(order[0])], builder.finish(), kRate);
    pixels += verdict.levels[0].alarms > 0 ? 1 : 0;
    blocks += verdict.levels[1].alarms > 0 ? 1 : 0;
    whole += verdict.levels[2].alarms > 0 ? 1 : 0;
    all += verdict.differs() ? 1 : 0;
  }
  const double each = 1.0 - std::cbrt(1.0 - kRate);
  const double scatter = 4.0 * std::sqrt(each * (1.0 - each) * kTrials);
  std::printf("false alarms of %d: pixel %d, block %d, picture %d, any %d; said %.0f, any %.0f\n",
              kTrials, pixels, blocks, whole, all, each * kTrials, kRate * kTrials);
  EXPECT_NEAR(blocks, each * kTrials, scatter);
  EXPECT_NEAR(whole, each * kTrials, scatter);
  EXPECT_LT(pixels, each * kTrials + scatter);
  EXPECT_LT(all, kRate * kTrials + 4.0 * std::sqrt(kRate * (1.0 - kRate) * kTrials));
}

}  // namespace
}  // namespace fstop
