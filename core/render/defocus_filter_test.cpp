#include "core/render/defocus_filter.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace fstop {
namespace {

constexpr int kSize = 64;
constexpr FilterKind kMean{.keeps_parabolas = false, .share = 0.25};
constexpr FilterKind kParabola{.keeps_parabolas = true, .share = 0.25};

// A film whose samples all lie `defocus` (1/metre) beside the focus, but for one block that is in
// focus at (sharp_x, sharp_y); none if negative.
ReplicateFilm film_of(float defocus, int sharp_x = -1, int sharp_y = -1) {
  ReplicateFilm film(kSize, kSize);
  for (std::size_t block = 0; block < film.grid().count(); ++block) {
    BlockSums sums;
    const bool sharp = film.grid().left(block) == sharp_x && film.grid().top(block) == sharp_y;
    sums.least_defocus = sharp ? 0.0F : defocus;
    for (int r = 0; r < kReplicates; ++r) film.add(r, block, sums, 1);
  }
  return film;
}

template <typename Value>
Image image_of(const Value& value) {
  Image image(kSize, kSize, 3);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(value(x, y, c));
    }
  }
  return image;
}

const Image& grey() {
  static const Image image = image_of([](int, int, int) { return 0.5; });
  return image;
}

TEST(DefocusFilter, WindowsAreAShareOfTheSmallestBlurAround) {
  // 20 px of blur, a quarter of it: 5 px.
  const DefocusFilter wide(film_of(2.0F), grey(), grey(), 10.0, kMean);
  for (int row = 0; row < wide.rows(); ++row) {
    for (int column = 0; column < wide.columns(); ++column) EXPECT_EQ(wide.radius(column, row), 5);
  }
  // The block at (24, 32) lies in tile (3, 4): that and its neighbours stay as they are.
  const DefocusFilter part(film_of(2.0F, 24, 32), grey(), grey(), 10.0, kMean);
  for (int row = 0; row < part.rows(); ++row) {
    for (int column = 0; column < part.columns(); ++column) {
      const bool near = std::abs(column - 3) <= 1 && std::abs(row - 4) <= 1;
      EXPECT_EQ(part.radius(column, row), near ? 0 : 5) << column << " " << row;
    }
  }
  EXPECT_FALSE(DefocusFilter(film_of(0.3F), grey(), grey(), 10.0, kMean).does_something());
  // Three weights that keep parabolas are 0, 1, 0.
  EXPECT_FALSE(DefocusFilter(film_of(0.7F), grey(), grey(), 10.0, kParabola).does_something());
  EXPECT_EQ(DefocusFilter(film_of(1e9F), grey(), grey(), 10.0, kMean).radius(0, 0),
            DefocusFilter::kLargestRadius);
}

TEST(DefocusFilter, LightBrighterThanWhiteStaysWhereItIs) {
  const Image spark = image_of([](int x, int y, int) { return x == 20 && y == 20 ? 1.5 : 0.5; });
  const DefocusFilter filter(film_of(2.0F), grey(), spark, 10.0, kMean);
  EXPECT_EQ(filter.radius(2, 2), 0);
  EXPECT_EQ(filter.radius(3, 3), 0);
  EXPECT_EQ(filter.radius(4, 4), 5);
}

TEST(DefocusFilter, KeepsParabolasOrTheirMeans) {
  const auto bowl = [](int x, int y, int c) {
    const double u = (x - 30.0) / 64.0;
    const double v = (y - 25.0) / 64.0;
    return 0.3 + 0.1 * c + 0.4 * u * u - 0.3 * v * v + 0.2 * u * v + 0.1 * u;
  };
  const Image picture = image_of(bowl);
  const DefocusFilter keeps(film_of(2.0F), picture, picture, 10.0, kParabola);
  const DefocusFilter means(film_of(2.0F), picture, picture, 10.0, kMean);
  const Image kept = keeps.applied(picture, {});
  const Image mean = means.applied(picture, {});
  // A mean over offsets -r to r of i^2 is r (r + 1)/3: 10 for 5, along both axes.
  const double shift = (0.4 - 0.3) * 10.0 / (64.0 * 64.0);
  for (int y = 8; y < kSize - 8; ++y) {
    for (int x = 8; x < kSize - 8; ++x) {
      // 22 products and sums of numbers below 1 round by 2^-24 each.
      EXPECT_NEAR(kept.at(x, y)[1], bowl(x, y, 1), 22 * 6e-8);
      EXPECT_NEAR(mean.at(x, y)[1], bowl(x, y, 1) + shift, 22 * 6e-8);
    }
  }
}

// Independent replicates of a picture of stripes that the filter wipes out in part.
struct Trial {
  explicit Trial(unsigned seed) : random(seed) {}
  Image replicate() {
    std::normal_distribution<double> noise(0.0, 0.05);
    return image_of([&](int x, int, int) { return stripes(x) + noise(random); });
  }
  static double stripes(int x) { return 0.5 + 0.1 * std::sin(0.5 * x); }
  std::mt19937 random;
};

TEST(FilterCertificate, TellsNoiseAndBiasWithoutBiasAndItsBoundHolds) {
  const ReplicateFilm film = film_of(2.0F);
  const Image truth = image_of([](int x, int, int) { return Trial::stripes(x); });
  constexpr int kTrials = 200;
  double told = 0.0;
  double told_squares = 0.0;
  double made = 0.0;
  double bias = 0.0;
  int under_bound = 0;
  Trial trial(7);
  for (int i = 0; i < kTrials; ++i) {
    const Image a = trial.replicate();
    const Image b = trial.replicate();
    const DefocusFilter filter(film, a, b, 10.0, kMean);
    const Image fa = filter.applied(a, {});
    const Image fb = filter.applied(b, {});
    const FilterCertificate certificate = filter_certificate(filter, a, b);
    // Half of the same picture: by 2 x 4 x 16^2 x 3 values, correlated over some 100.
    EXPECT_NEAR(filter_certificate(filter, a, b, 2).mse, certificate.mse, 0.5 * certificate.mse);
    double error = 0.0;
    for (std::size_t k = 0; k < truth.pixels().size(); ++k) {
      const double off = 0.5 * (fa.pixels()[k] + fb.pixels()[k]) - truth.pixels()[k];
      error += off * off / static_cast<double>(truth.pixels().size());
    }
    told += certificate.mse / kTrials;
    told_squares += certificate.mse * certificate.mse / kTrials;
    made += error / kTrials;
    bias += certificate.bias_squared / kTrials;
    under_bound += error <= certificate.mse_upper_95 ? 1 : 0;
  }
  const double standard_error = std::sqrt((told_squares - told * told) / kTrials);
  EXPECT_NEAR(told, made, 4.0 * standard_error + 0.01 * made);
  // Away from the borders, a window of 11 leaves sin(11/4)/(11 sin(1/4)) = 0.1402 of the stripes:
  // a bias of (1 - 0.1402) 0.1/sqrt 2; the mirrored borders differ in 5 of 32 columns.
  EXPECT_NEAR(bias, std::pow((1.0 - 0.1402) * 0.1, 2) / 2.0, 0.15 * bias);
  // 190 are promised; 3 standard deviations of a binomial less.
  EXPECT_GE(under_bound, 190 - 9);
}

}  // namespace
}  // namespace fstop
