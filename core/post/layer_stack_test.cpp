#include "core/post/layer_stack.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 24;

Image flat_layer(float r, float g, float b, float alpha, int width = kWidth, int height = kHeight) {
  Image layer(width, height, 4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float values[] = {r, g, b, alpha};
      std::copy_n(values, 4, layer.at(x, y));
    }
  }
  return layer;
}

// Root mean square difference of channels [first, last), values clipped to [0,1].
double rmse(const Image& a, const Image& b, int first, int last) {
  double sum = 0.0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      for (int c = first; c < last; ++c) {
        const double difference = double{std::clamp(a.at(x, y)[c], 0.0F, 1.0F)} -
                                  double{std::clamp(b.at(x, y)[c], 0.0F, 1.0F)};
        sum += difference * difference;
      }
    }
  }
  return std::sqrt(sum / (static_cast<double>(a.width()) * a.height() * (last - first)));
}

LayerError error_between(const Image& a, const Image& b) {
  return {.color = rmse(a, b, 0, 3), .alpha = rmse(a, b, 3, 4)};
}

TEST(LayerStack, AnEmptyCanvasTakesALayerAsItIs) {
  LayerStack stack(kWidth, kHeight);
  const Image layer = flat_layer(0.25F, 0.5F, 0.125F, 0.75F);
  stack.add(layer, {.color = 0.01, .alpha = 0.02}, {});
  EXPECT_EQ(stack.layer(), layer);
  EXPECT_EQ(stack.error().color, 0.01);
  EXPECT_EQ(stack.error().alpha, 0.02);
}

// Half the opacity halves colour, alpha and their errors.
TEST(LayerStack, OpacityScalesALayer) {
  LayerStack stack(kWidth, kHeight);
  stack.add(flat_layer(0.5F, 0.25F, 0.125F, 0.5F), {.color = 0.5, .alpha = 0.25}, {.opacity = 0.5});
  EXPECT_EQ(stack.layer(), flat_layer(0.25F, 0.125F, 0.0625F, 0.25F));
  EXPECT_EQ(stack.error().color, 0.25);
  EXPECT_EQ(stack.error().alpha, 0.125);
}

// A quarter of the canvas: the same squares over four times the pixels. Beyond it is cut off.
TEST(LayerStack, AnOffsetMovesALayerAndCutsItOff) {
  LayerStack stack(4, 4);
  Image layer = flat_layer(0.5F, 0.5F, 0.5F, 1.0F, 2, 2);
  layer.at(1, 1)[0] = 1.0F;
  stack.add(layer, {.color = 0.5}, {.left = 3, .top = -1});
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      EXPECT_EQ(stack.layer().at(x, y)[3], x == 3 && y == 0 ? 1.0F : 0.0F) << x << ", " << y;
    }
  }
  EXPECT_EQ(stack.layer().at(3, 0)[0], 0.5F);
  EXPECT_EQ(stack.error().color, 0.25);
  stack.add(layer, {}, {.left = 2'000'000'000, .top = -2'000'000'000});  // nowhere
  EXPECT_EQ(stack.layer().at(3, 0)[0], 0.5F);
}

// Errors of one sign everywhere: e + f B over what is exact, (1 - a) E under what is exact, and all
// three at once.
TEST(LayerStack, TheBoundOfOverIsAttained) {
  const Image beneath = flat_layer(0.5F, 0.5F, 0.5F, 1.0F);
  const Image beneath_seen = flat_layer(0.625F, 0.625F, 0.625F, 1.0F);
  const Image top = flat_layer(0.125F, 0.125F, 0.125F, 0.25F);
  const Image top_seen = flat_layer(0.25F, 0.25F, 0.25F, 0.125F);
  const auto stacked = [](const Image& below, double error_below, const Image& above,
                          const LayerError& error_above) {
    LayerStack stack(kWidth, kHeight);
    stack.add(below, {.color = error_below}, {});
    stack.add(above, error_above, {});
    return stack;
  };
  const LayerStack truth = stacked(beneath, 0.0, top, {});
  EXPECT_EQ(truth.error().color, 0.0);
  const LayerError of_top{.color = 0.125, .alpha = 0.125};
  const LayerStack one = stacked(beneath, 0.0, top_seen, of_top);
  EXPECT_EQ(one.error().color, 0.125 + 0.125 * 0.5);
  EXPECT_EQ(rmse(truth.layer(), one.layer(), 0, 3), one.error().color);
  const LayerStack other = stacked(beneath_seen, 0.125, top, {});
  EXPECT_EQ(other.error().color, 0.75 * 0.125);
  EXPECT_EQ(rmse(truth.layer(), other.layer(), 0, 3), other.error().color);
  const LayerStack both = stacked(beneath_seen, 0.125, top_seen, of_top);
  EXPECT_EQ(both.error().color, 0.125 + 0.125 + 0.875 * 0.125);
  EXPECT_EQ(rmse(truth.layer(), both.layer(), 0, 3), 0.125 + 0.125 * 0.5 + 0.875 * 0.125);
}

Image random_layer(std::mt19937& random, bool is_opaque, float brightest) {
  std::uniform_real_distribution<float> share(0.0F, 1.0F);
  Image layer(kWidth, kHeight, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      float* pixel = layer.at(x, y);
      pixel[3] = is_opaque || share(random) < 0.3F ? 1.0F : share(random);
      if (!is_opaque && share(random) < 0.3F) pixel[3] = 0.0F;
      for (int c = 0; c < 3; ++c) pixel[c] = brightest * pixel[3] * share(random);
    }
  }
  return layer;
}

Image disturbed(std::mt19937& random, const Image& layer, float by, bool is_opaque) {
  std::normal_distribution<float> noise(0.0F, by);
  Image result = layer;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      float* pixel = result.at(x, y);
      for (int c = 0; c < 3; ++c) pixel[c] = std::max(0.0F, pixel[c] + noise(random));
      if (!is_opaque) pixel[3] = std::clamp(pixel[3] + noise(random), 0.0F, 1.0F);
    }
  }
  return result;
}

// True and disturbed stacks of three layers: the bound holds of every one, light beyond white too.
TEST(LayerStack, TheBoundHoldsForRandomLayers) {
  std::mt19937 random(7);
  double loosest = 0.0;  // bound over error, where nothing is brighter than white
  for (int trial = 0; trial < 60; ++trial) {
    const float by = trial % 2 == 0 ? 0.005F : 0.05F;
    const float brightest = trial % 3 == 0 ? 1.5F : 0.75F;
    LayerStack truth(kWidth, kHeight), made(kWidth, kHeight);
    for (int k = 0; k < 3; ++k) {
      const bool is_opaque = k == 0;
      const Image layer = random_layer(random, is_opaque, brightest);
      const Image seen = disturbed(random, layer, by, is_opaque);
      const LayerPlace place{.opacity = k == 2 ? 0.75 : 1.0};
      truth.add(layer, {}, place);
      made.add(seen, error_between(layer, seen), place);
    }
    const double color = rmse(truth.layer(), made.layer(), 0, 3);
    EXPECT_LE(color, made.error().color) << trial;
    EXPECT_LE(rmse(truth.layer(), made.layer(), 3, 4), made.error().alpha + 1e-7) << trial;
    if (brightest < 1.0F) loosest = std::max(loosest, made.error().color / color);
  }
  // The bound adds e + f of each of three layers, 5 e where the lowest is exact in alpha, and takes
  // the largest of light and of what passes; noise adds in squares, and about half of it is hidden.
  std::printf("bound of a stack over its error, at most: %.2f\n", loosest);
  EXPECT_LT(loosest, 5.0);
}

// Overlay decides pixel by pixel: what may fall either way is its fringe.
TEST(LayerStack, OverlayCountsTheFringeOfWhatIsNotExact) {
  Image top(kWidth, kHeight, 4);
  for (int y = 8; y < 16; ++y) {
    for (int x = 8; x < 16; ++x) top.at(x, y)[1] = 0.5F;
  }
  LayerStack exact(kWidth, kHeight), rendered(kWidth, kHeight);
  for (LayerStack* stack : {&exact, &rendered}) stack->add(flat_layer(1, 1, 1, 1), {}, {});
  exact.add(top, {}, {.operation = LayerOperation::overlay});
  rendered.add(top, {.color = 0.01}, {.operation = LayerOperation::overlay});
  EXPECT_EQ(exact.layer(), rendered.layer());
  EXPECT_EQ(exact.error().color, 0.0);
  // Of the square of 8 x 8 the ring inside, 28 pixels, and the ring about it, 36.
  EXPECT_NEAR(rendered.unsure_share(), 64.0 / (kWidth * kHeight), 1e-12);
  EXPECT_NEAR(rendered.error().color, 0.01 + std::sqrt(64.0 / (kWidth * kHeight)), 1e-12);
}

// |A d|/|d| of the matrix (Cb, Cr) over directions of colour: never above the constant, and near
// it.
TEST(LayerStack, TheKeysGainIsTheLargestOfTheChromaMatrix) {
  const double key_error =
      keyed_error({.color = {0, 0, 0}, .softness = 1.0}, Image(1, 1, 3), 0.01).alpha;
  const double gain = key_error / (0.01 * std::sqrt(3.0));
  std::mt19937 random(3);
  std::normal_distribution<float> any;
  double largest = 0.0;
  const float black[] = {0, 0, 0};
  for (int i = 0; i < 20'000; ++i) {
    const float color[] = {any(random), any(random), any(random)};
    const double length = std::hypot(color[0], color[1], color[2]);
    largest = std::max(largest, chroma_distance(color, black) / length);
  }
  EXPECT_LE(largest, gain);
  EXPECT_GT(largest, 0.999 * gain);
}

TEST(LayerStack, KeyedErrorsBoundWhatNoiseDoes) {
  std::mt19937 random(11);
  const ChromaKey key{.color = {0.1F, 0.8F, 0.2F}, .tolerance = 0.1, .softness = 0.2};
  Image plate(kWidth, kHeight, 3), seen(kWidth, kHeight, 3);
  std::uniform_real_distribution<float> share(0.0F, 1.0F);
  std::normal_distribution<float> noise(0.0F, 0.02F);
  for (std::size_t i = 0; i < plate.pixels().size(); ++i) {
    plate.pixels()[i] = share(random);
    seen.pixels()[i] = std::clamp(plate.pixels()[i] + noise(random), 0.0F, 1.0F);
  }
  const LayerError bound = keyed_error(key, seen, rmse(plate, seen, 0, 3));
  const Image truth = keyed(plate, key);
  const Image made = keyed(seen, key);
  EXPECT_LE(rmse(truth, made, 0, 3), bound.color);
  EXPECT_LE(rmse(truth, made, 3, 4), bound.alpha);
  EXPECT_GT(rmse(truth, made, 3, 4), 0.1 * bound.alpha);
  EXPECT_EQ(keyed_error({.softness = 0.0}, seen, 1e-9).alpha, 1.0);
  EXPECT_EQ(keyed_error({.softness = 0.0}, seen, 0.0).alpha, 0.0);
}

// Beyond white the error of clipped values says nothing of how far a colour is off.
TEST(LayerStack, KeyedErrorsHoldForLightBeyondWhite) {
  const ChromaKey key{.color = {0.1F, 0.8F, 0.2F}, .tolerance = 0.1, .softness = 0.2};
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    Image plate(kWidth, kHeight, 3), seen(kWidth, kHeight, 3);
    std::uniform_real_distribution<float> grey(2.0F, 3.0F);
    std::normal_distribution<float> noise(0.0F, 0.2F);
    for (std::size_t i = 0; i < plate.pixels().size(); ++i) {
      const bool is_light = i % 30 < 3;
      plate.pixels()[i] = is_light ? grey(random) : 0.5F;
      seen.pixels()[i] =
          is_light ? plate.pixels()[i] + noise(random) : 0.5F + 0.01F * noise(random);
    }
    const LayerError bound = keyed_error(key, seen, rmse(plate, seen, 0, 3));
    EXPECT_LE(rmse(keyed(plate, key), keyed(seen, key), 3, 4), bound.alpha) << "seed " << seed;
    EXPECT_LT(bound.alpha, 0.5);
  }
}

TEST(LayerStack, RefusesWhatIsNoLayer) {
  EXPECT_THROW(LayerStack(0, 4), Error);
  LayerStack stack(2, 2);
  EXPECT_THROW(stack.add(Image(2, 2, 3), {}, {}), Error);
  EXPECT_THROW(stack.add(Image(2, 2, 4), {}, {.opacity = 1.5}), Error);
}

}  // namespace
}  // namespace fstop
