// What leaving an effect out changes lies within what reports state, around the threshold where
// each starts to matter.
#include "tests/methods/omission.h"

#include <cstdlib>
#include <functional>
#include <iostream>

#include <gtest/gtest.h>

namespace fstop {
namespace {

// All cases are a matter of minutes; every build tries as many as FSTOP_OMISSION_CASES says.
int cases() {
  const char* asked = std::getenv("FSTOP_OMISSION_CASES");
  return asked != nullptr ? std::atoi(asked) : 12;
}

void expect_bounds(const std::function<OmissionTrial(std::uint32_t)>& trial) {
  std::vector<OmissionTrial> trials;
  for (int i = 0; i < cases(); ++i) trials.push_back(trial(static_cast<std::uint32_t>(i)));
  print_omissions(std::cout, trials);
  for (const OmissionTrial& t : trials) {
    EXPECT_TRUE(t.holds()) << t.effect << ", case " << t.seed << ": changes " << t.change
                           << ", bound " << t.bound << ", strength " << t.strength;
  }
}

TEST(Omission, Defocus) { expect_bounds(defocus_omitted); }
TEST(Omission, Diffraction) { expect_bounds(diffraction_omitted); }
TEST(Omission, Motion) { expect_bounds(motion_omitted); }
TEST(Omission, AreaLight) { expect_bounds(area_light_omitted); }
TEST(Omission, ReflectionDepth) { expect_bounds(reflection_omitted); }
TEST(Omission, TextureDetail) { expect_bounds(texture_detail_omitted); }
TEST(Omission, Falloff) { expect_bounds(falloff_omitted); }

}  // namespace
}  // namespace fstop
