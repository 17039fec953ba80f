#include "core/scene/texture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"

namespace fstop {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A value that tells texels and channels apart: 0 to 1 in steps of 1/64 that single precision
// holds.
float value_at(int x, int y, int c) {
  return static_cast<float>((7 * x + 13 * y + 29 * c) % 64) / 64;
}

TextureSource source_of(int width, int height, TextureFilter filter,
                        TextureWrap wrap = TextureWrap::repeat) {
  TextureSource source{.name = "card", .filter = filter, .wrap = wrap, .image = {width, height, 3}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) source.image.at(x, y)[c] = value_at(x, y, c);
    }
  }
  return source;
}

// Centre of texel (x, y) of a level of the given size; row 0 is at the top, v = 1.
float u_of(int x, int width) { return (static_cast<float>(x) + 0.5F) / static_cast<float>(width); }
float v_of(int y, int height) {
  return 1.0F - (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
}

// A texel coordinate has four roundings of 2^-24 of up to 16 texels: the wrong neighbour enters
// with at most 4e-6.
constexpr float kTolerance = 4e-6F;

void expect_texel(const Rgb& actual, int x, int y, float tolerance = kTolerance) {
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(actual[static_cast<std::size_t>(c)], value_at(x, y, c), tolerance)
        << "texel " << x << ", " << y << " channel " << c;
  }
}

TEST(Texture, TexelCentresAreExact) {
  for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear,
                                     TextureFilter::mipmap, TextureFilter::brute_force}) {
    for (const auto& [width, height] : {std::pair{8, 4}, {5, 3}, {1, 7}, {13, 1}, {1, 1}}) {
      const Texture texture(source_of(width, height, filter));
      const bool power_of_two = width == 8;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          expect_texel(texture.sample(u_of(x, width), v_of(y, height), 1.0F), x, y,
                       power_of_two ? 0.0F : kTolerance);
        }
      }
    }
  }
}

TEST(Texture, VPointsUp) {
  const Texture texture(source_of(4, 4, TextureFilter::nearest));
  expect_texel(texture.sample(0.01F, 0.99F, 1.0F), 0, 0);
  expect_texel(texture.sample(0.01F, 0.01F, 1.0F), 0, 3);
  expect_texel(texture.sample(0.99F, 0.01F, 1.0F), 3, 3);
}

TEST(Texture, BilinearMidpointsAreMeans) {
  const Texture texture(source_of(8, 8, TextureFilter::bilinear));
  const auto mean = [](int x0, int y0, int x1, int y1, int c) {
    return (value_at(x0, y0, c) + value_at(x1, y0, c) + value_at(x0, y1, c) + value_at(x1, y1, c)) /
           4;
  };
  const Rgb between_columns = texture.sample(3.0F / 8, v_of(5, 8), 1.0F);
  const Rgb between_rows = texture.sample(u_of(2, 8), 1.0F - 3.0F / 8, 1.0F);
  const Rgb between_four = texture.sample(3.0F / 8, 1.0F - 3.0F / 8, 1.0F);
  for (int c = 0; c < 3; ++c) {
    const auto k = static_cast<std::size_t>(c);
    EXPECT_FLOAT_EQ(between_columns[k], mean(2, 5, 3, 5, c));
    EXPECT_FLOAT_EQ(between_rows[k], mean(2, 2, 2, 3, c));
    EXPECT_FLOAT_EQ(between_four[k], mean(2, 2, 3, 3, c));
  }
  // A quarter of the way: three parts to one.
  const Rgb quarter = texture.sample((2.75F) / 8, v_of(5, 8), 1.0F);
  EXPECT_FLOAT_EQ(quarter[0], 0.75F * value_at(2, 5, 0) + 0.25F * value_at(3, 5, 0));
}

TEST(Texture, RepeatStartsAgainAtEveryWholeNumber) {
  for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear}) {
    const Texture texture(source_of(8, 8, filter));
    for (const float shift : {1.0F, -1.0F, -3.0F, 100.0F, -4096.0F, 65536.0F}) {
      // Sixteenths and these shifts are exact in single precision together.
      expect_texel(texture.sample(u_of(2, 8) + shift, v_of(6, 8), 1.0F), 2, 6, 0.0F);
      expect_texel(texture.sample(u_of(2, 8), v_of(6, 8) + shift, 1.0F), 2, 6, 0.0F);
    }
  }
}

TEST(Texture, RepeatInterpolatesAcrossTheSeam) {
  const Texture texture(source_of(8, 8, TextureFilter::bilinear));
  for (const float u : {0.0F, 1.0F, -1.0F}) {
    const Rgb seam = texture.sample(u, v_of(3, 8), 1.0F);
    EXPECT_FLOAT_EQ(seam[0], 0.5F * (value_at(7, 3, 0) + value_at(0, 3, 0)));
  }
  for (const float v : {0.0F, 1.0F, 5.0F}) {
    const Rgb seam = texture.sample(u_of(3, 8), v, 1.0F);
    EXPECT_FLOAT_EQ(seam[0], 0.5F * (value_at(3, 7, 0) + value_at(3, 0, 0)));
  }
}

TEST(Texture, ClampGoesOnWithTheBorder) {
  for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear}) {
    const Texture texture(source_of(8, 4, filter, TextureWrap::clamp));
    for (const float far : {0.0F, 0.01F, 0.7F, 3.0F, 1e5F, 9e5F, 2e6F, 1e20F, kInfinity}) {
      expect_texel(texture.sample(1.0F + far, v_of(2, 4), 1.0F), 7, 2);
      expect_texel(texture.sample(-far, v_of(2, 4), 1.0F), 0, 2);
      expect_texel(texture.sample(u_of(5, 8), 1.0F + far, 1.0F), 5, 0);
      expect_texel(texture.sample(u_of(5, 8), -far, 1.0F), 5, 3);
    }
  }
}

// Beyond 2^23 single precision has no fraction left: some texel, but no fault and no NaN.
TEST(Texture, HugeAndMissingCoordinatesStayInTheImage) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp}) {
    for (const TextureFilter filter :
         {TextureFilter::nearest, TextureFilter::bilinear, TextureFilter::mipmap}) {
      const Texture texture(source_of(13, 9, filter, wrap));
      for (const float u : {1e6F, -1e6F, 1e7F, -3e9F, 1e30F, kInfinity, -kInfinity, nan, -1e-9F}) {
        for (const float footprint : {1.0F, 3.0F, 1e9F, kInfinity, nan}) {
          for (const float channel : texture.sample(u, 0.3F, footprint)) {
            ASSERT_TRUE(channel >= 0.0F && channel <= 1.0F) << u << " " << footprint;
          }
          for (const float channel : texture.sample(0.3F, u, footprint)) {
            ASSERT_TRUE(channel >= 0.0F && channel <= 1.0F) << u << " " << footprint;
          }
        }
      }
    }
  }
}

constexpr std::pair<int, int> kSizes[] = {{8, 8},  {16, 4}, {5, 3}, {7, 1},
                                          {13, 9}, {1, 6},  {9, 16}};

// Texel centres of level k are the mean of what lies under them: the mean of the level is the mean
// of the image, whatever the size. Roundings: 2^-24 for each of up to 4 levels and 144 texels.
TEST(Texture, EveryLevelHasTheMeanOfTheImage) {
  for (const auto& [width, height] : kSizes) {
    const TextureSource source = source_of(width, height, TextureFilter::mipmap);
    const Texture texture(source);
    std::array<double, 3> mean = {};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          mean[static_cast<std::size_t>(c)] += value_at(x, y, c) / double(width * height);
        }
      }
    }
    int w = width;
    int h = height;
    for (int level = 1; w > 1 || h > 1; ++level) {
      w = std::max(1, w / 2);
      h = std::max(1, h / 2);
      std::array<double, 3> sum = {};
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
          const Rgb texel = texture.sample(u_of(x, w), v_of(y, h), std::exp2(float(level)));
          for (std::size_t c = 0; c < 3; ++c) sum[c] += texel[c] / double(w * h);
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(sum[c], mean[c], 2e-6) << width << " x " << height << ", level " << level;
      }
    }
  }
}

TEST(Texture, FootprintOfTwoTexelsReadsMeansOfFour) {
  const Texture texture(source_of(8, 8, TextureFilter::mipmap));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const Rgb texel = texture.sample(u_of(x, 4), v_of(y, 4), 2.0F);
      const float mean = (value_at(2 * x, 2 * y, 0) + value_at(2 * x + 1, 2 * y, 0) +
                          value_at(2 * x, 2 * y + 1, 0) + value_at(2 * x + 1, 2 * y + 1, 0)) /
                         4;
      EXPECT_FLOAT_EQ(texel[0], mean);
    }
  }
}

TEST(Texture, FootprintBetweenTwoLevelsBlendsThem) {
  const Texture texture(source_of(16, 16, TextureFilter::mipmap));
  for (const float u : {0.1F, 0.37F, 0.9F}) {
    const float finer = texture.sample(u, 0.4F, 2.0F)[0];
    const float coarser = texture.sample(u, 0.4F, 4.0F)[0];
    EXPECT_NEAR(texture.sample(u, 0.4F, 2.0F * std::sqrt(2.0F))[0], 0.5F * (finer + coarser),
                1e-6F);
    // log2(3) - 1 = 0.585 of the way.
    EXPECT_NEAR(texture.sample(u, 0.4F, 3.0F)[0], finer + 0.5849625F * (coarser - finer), 1e-6F);
  }
}

TEST(Texture, SmallFootprintsReadTheFullImage) {
  const Texture mipmap(source_of(16, 16, TextureFilter::mipmap));
  const Texture bilinear(source_of(16, 16, TextureFilter::bilinear));
  for (const float footprint : {1.0F, 0.5F, 0.0F, -1.0F, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_EQ(mipmap.sample(0.41F, 0.77F, footprint), bilinear.sample(0.41F, 0.77F, 1.0F));
  }
}

TEST(Texture, LargeFootprintsReadTheMeanOfTheImage) {
  const Texture texture(source_of(16, 4, TextureFilter::mipmap));
  const Rgb mean = texture.sample(0.5F, 0.5F, 16.0F);
  for (const float footprint : {17.0F, 1e6F, kInfinity}) {
    EXPECT_EQ(texture.sample(0.13F, 0.9F, footprint), mean);
  }
}

TEST(Texture, OtherFiltersReadTheFullImageWhateverTheFootprint) {
  for (const TextureFilter filter :
       {TextureFilter::nearest, TextureFilter::bilinear, TextureFilter::brute_force}) {
    const Texture texture(source_of(16, 16, filter));
    const Rgb sharp = texture.sample(0.41F, 0.77F, 1.0F);
    for (const float footprint : {2.0F, 100.0F}) {
      EXPECT_EQ(texture.sample(0.41F, 0.77F, footprint), sharp);
    }
  }
  EXPECT_EQ(Texture(source_of(9, 7, TextureFilter::brute_force)).sample(0.3F, 0.2F, 5.0F),
            Texture(source_of(9, 7, TextureFilter::bilinear)).sample(0.3F, 0.2F, 5.0F));
}

TEST(Texture, TellsItsSize) {
  EXPECT_FLOAT_EQ(Texture(source_of(16, 4, TextureFilter::mipmap)).texels_per_uv(), 8.0F);
  // Levels of 16 x 4, 8 x 2, 4 x 1, 2 x 1 and 1 x 1 texels of four floats, each with one column and
  // one row more.
  EXPECT_EQ(Texture(source_of(16, 4, TextureFilter::bilinear)).memory_bytes(), 17U * 5 * 16);
  EXPECT_EQ(Texture(source_of(16, 4, TextureFilter::mipmap)).memory_bytes(),
            (17U * 5 + 9 * 3 + 5 * 2 + 3 * 2 + 2 * 2) * 16);
}

// A packet's lookups are those of its lanes, one by one, where all lanes are of one footprint.
TEST(Texture, PacketsReadWhatSingleLookupsRead) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> anywhere(-2.5F, 3.5F);
  LaneMask valid;
  valid.fill(-1);
  for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp}) {
    for (const auto& [width, height] : {std::pair{70, 33}, std::pair{5, 1}, std::pair{1, 1}}) {
      const Texture texture(source_of(width, height, TextureFilter::mipmap, wrap));
      for (const float size : {0.3F, 1.0F, 1.7F, 2.0F, 5.3F, 40.0F, kInfinity}) {
        LaneFloats u, v, footprint;
        footprint.fill(size);
        for (float& x : u) x = anywhere(random);
        for (float& x : v) x = anywhere(random);
        LaneColors colors;
        texture.sample(valid, u, v, footprint, colors);
        for (std::size_t k = 0; k < kLanes; ++k) {
          EXPECT_EQ(colors.get(static_cast<int>(k)), texture.sample(u[k], v[k], size))
              << width << " x " << height << ", " << u[k] << ", " << v[k] << ", " << size;
        }
      }
    }
  }
}

// A packet's lanes share a pair of levels, so its footprints lie within one. The rest rounds as
// single lookups do; values lie in [0,1].
TEST(Texture, PacketsAgreeWithSingleLookups) {
  std::mt19937 random(23);
  std::uniform_real_distribution<float> coordinate(-3.0F, 4.0F);
  std::uniform_real_distribution<float> share(0.01F, 0.99F);
  for (const TextureFilter filter : {TextureFilter::nearest, TextureFilter::bilinear,
                                     TextureFilter::mipmap, TextureFilter::brute_force}) {
    for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp}) {
      for (const auto& [width, height] : kSizes) {
        const Texture texture(source_of(width, height, filter, wrap));
        for (int i = 0; i < 40; ++i) {
          alignas(64) LaneMask valid = {};
          std::array<float, kLanes> u = {}, v = {}, footprint = {};
          const auto level = static_cast<float>(i % 7) - 2.0F;
          for (std::size_t k = 0; k < kLanes; ++k) {
            valid[k] = i % 2 == 0 || random() % 3 != 0 ? -1 : 0;
            u[k] = coordinate(random);
            v[k] = coordinate(random);
            footprint[k] = std::exp2(level + share(random));
          }
          LaneColors colors;
          texture.sample(valid, u, v, footprint, colors);
          for (std::size_t k = 0; k < kLanes; ++k) {
            if (valid[k] == 0) continue;
            const Rgb one = texture.sample(u[k], v[k], footprint[k]);
            const Rgb lane = colors.get(static_cast<int>(k));
            for (std::size_t c = 0; c < 3; ++c) {
              ASSERT_NEAR(lane[c], one[c], 2 * kTolerance)
                  << width << " x " << height << " at " << u[k] << ", " << v[k] << ", footprint "
                  << footprint[k] << ", filter " << static_cast<int>(filter);
            }
          }
        }
      }
    }
  }
}

ErrorCode refusal(const TextureSource& source) {
  try {
    const Texture texture(source);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::internal;
}

TEST(Texture, RefusesWhatIsNoColourImage) {
  TextureSource source = source_of(4, 4, TextureFilter::bilinear);
  source.image = Image{};
  EXPECT_EQ(refusal(source), ErrorCode::bad_image);
  source.image = Image(4, 4, 1);
  EXPECT_EQ(refusal(source), ErrorCode::bad_image);
  source.image = Image(4, 4, 4);
  EXPECT_EQ(refusal(source), ErrorCode::bad_image);
}

}  // namespace
}  // namespace fstop
