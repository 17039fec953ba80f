#include "core/render/light_layers.h"

#include <gtest/gtest.h>

namespace fstop {
namespace {

TEST(LightLayers, LightFallsIntoItsCellAndLayer) {
  LightLayers layers(40, 24, 2, 3);
  layers.add(17.3, 5.6, 1, {1.0F, 2.0F, 3.0F});  // cell (34, 11)
  layers.add(17.4, 5.9, 1, {1.0F, 2.0F, 3.0F});
  layers.add(39.999999, 23.999999, 2, {4.0F, 0.0F, 0.0F});
  Image plane(80, 48, 1);
  layers.add_to(plane.view(), 0, 0, 1, 1, 0.5F);
  EXPECT_EQ(*plane.at(34, 11), 2.0F);
  float sum = 0.0F;
  for (const float value : plane.pixels()) sum += value;
  EXPECT_EQ(sum, 2.0F);
  layers.add_to(plane.view(), 0, 0, 2, 0, 1.0F);
  EXPECT_EQ(*plane.at(79, 47), 4.0F);
  EXPECT_EQ(layers.area(0).right, 0);
  EXPECT_EQ(layers.area(1).left, 32);  // the second tile of 32 cells
  EXPECT_EQ(layers.area(1).right, 64);
  EXPECT_EQ(layers.area(2).bottom, 48);
}

TEST(LightLayers, PlanesMayLieAnywhere) {
  LightLayers layers(40, 24, 1, 1);
  layers.add(20.5, 10.5, 0, {1.0F, 1.0F, 1.0F});
  Image window(8, 8, 1);
  layers.add_to(window.view(), 17, 6, 0, 0, 1.0F);
  EXPECT_EQ(*window.at(3, 4), 1.0F);
  Image beside(8, 8, 1);
  layers.add_to(beside.view(), -4, -4, 0, 0, 1.0F);
  layers.add_to(beside.view(), 36, 20, 0, 0, 1.0F);
  for (const float value : beside.pixels()) EXPECT_EQ(value, 0.0F);
}

TEST(LightLayers, TakingJoinsAndLeavesDarkness) {
  LightLayers total(16, 16, 1, 2);
  LightLayers pass(16, 16, 1, 2);
  total.add(1.0, 1.0, 0, {1.0F, 0.0F, 0.0F});
  pass.add(1.0, 1.0, 0, {2.0F, 0.0F, 0.0F});
  pass.add(3.0, 1.0, 1, {5.0F, 0.0F, 0.0F});
  total.take(pass);
  Image plane(16, 16, 1);
  total.add_to(plane.view(), 0, 0, 0, 0, 1.0F);
  EXPECT_EQ(*plane.at(1, 1), 3.0F);
  total.add_to(plane.view(), 0, 0, 1, 0, 1.0F);
  EXPECT_EQ(*plane.at(3, 1), 5.0F);
  EXPECT_EQ(pass.area(0).right, 0);
}

}  // namespace
}  // namespace fstop
