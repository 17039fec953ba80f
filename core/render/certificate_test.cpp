#include "core/render/certificate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/bar_scenes.h"
#include "core/render/progressive.h"

namespace fstop {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 48;

// A truth between 0.2 and 0.6.
double truth_at(int x, int y, std::size_t c) {
  return 0.4 + 0.2 * std::sin(0.4 * x + 0.3 * y + static_cast<double>(c));
}

Image truth() {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (std::size_t c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(truth_at(x, y, c));
    }
  }
  return image;
}

// An error of up to `size` that fills one eighth of the picture: strong there, none elsewhere.
Image with_local_error(Image image, float size) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 8; ++x) {
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] += (x + y) % 3 == 0 ? size : -0.5F * size;
    }
  }
  return image;
}

// Noise of mean 0 in [-1/9, 1]: one sample in ten is bright, `share` of it is one for all pixels of
// a block, as with pupil points.
ReplicateFilm noisy_film(std::uint32_t seed, double scale, double share) {
  ReplicateFilm film(kWidth, kHeight);
  std::mt19937 random(seed);
  std::bernoulli_distribution bright(0.1);
  const auto noise = [&] { return scale * (bright(random) ? 1.0 : -1.0 / 9.0); };
  for (int r = 0; r < kReplicates; ++r) {
    for (std::size_t block = 0; block < film.grid().count(); ++block) {
      BlockSums sums;
      const double shared = noise();
      film.grid().for_each_pixel(block, [&](std::size_t lane, int x, int y) {
        for (std::size_t c = 0; c < 3; ++c) {
          sums.value[c][lane] = truth_at(x, y, c) + share * shared + (1.0 - share) * noise();
        }
      });
      film.add(r, block, sums, 1);
    }
  }
  return film;
}

struct Trials {
  int held = 0;
  double mean = 0.0;
  double deviation = 0.0;
};

// The signed estimate cannot be had where it is cut at 0; pictures here are wrong enough.
Trials trials_of(const Image& picture, double scale, double share) {
  constexpr int kTrials = 200;
  const double mse = mse_of(picture, truth());
  Trials trials;
  double squares = 0.0;
  for (std::uint32_t seed = 0; seed < kTrials; ++seed) {
    const Certificate c = certificate_of(picture, noisy_film(seed, scale, share));
    trials.held += mse <= c.error.mse_upper_95 ? 1 : 0;
    trials.mean += c.error.mse / kTrials;
    squares += c.error.mse * c.error.mse / kTrials;
  }
  trials.deviation = std::sqrt(squares - trials.mean * trials.mean);
  return trials;
}

TEST(Certificate, BoundHoldsAndTheEstimateIsUnbiased) {
  // Noise of 0.05 to 0.1, of single pixels or of whole blocks; errors of the same size and larger.
  for (const double share : {0.0, 0.5, 1.0}) {
    for (const float size : {0.1F, 0.3F}) {
      const Image picture = with_local_error(truth(), size);
      const double mse = mse_of(picture, truth());
      const Trials trials = trials_of(picture, 0.3, share);
      EXPECT_GE(trials.held, 190) << "share " << share << ", error " << size;
      // Four standard errors of the mean of 200.
      EXPECT_NEAR(trials.mean, mse, 4.0 * trials.deviation / std::sqrt(200.0))
          << "share " << share << ", error " << size;
    }
  }
}

TEST(Certificate, BoundIsTightWhereTheErrorIsLocal) {
  // All error lies in an eighth of the picture, and noise is a tenth of it: a bound from the
  // scatter between blocks could not come within 15 % of the estimate.
  const Image picture = with_local_error(truth(), 0.3F);
  const Certificate c = certificate_of(picture, noisy_film(7, 0.05, 0.0));
  EXPECT_LT(c.error.mse_upper_95, 1.05 * c.error.mse);
}

TEST(Certificate, OfAPerfectPictureIsNothingButItsScatter) {
  const Image picture = truth();
  int near = 0;
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    const ReplicateFilm film = noisy_film(seed, 0.3, 0.5);
    const Certificate c = certificate_of(picture, film);
    // The replicates' own mean squared error is the film's estimate twice.
    EXPECT_LT(c.error.mse_upper_95, film.noise().mse) << seed;
    near += c.error.mse <= 1.645 * c.standard_error ? 1 : 0;
  }
  EXPECT_GE(near, 190);
}

TEST(Certificate, ClippingHidesNoErrorFromTheBound) {
  // One sample in ten at 1.9, the others at 0.79: their mean is 0.901, that of clipped ones 0.811,
  // which is just what the picture shows.
  Image picture(kWidth, kHeight, 3);
  std::ranges::fill(picture.pixels(), 0.811F);
  int held = 0;
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::bernoulli_distribution bright(0.1);
    ReplicateFilm film(kWidth, kHeight);
    for (int r = 0; r < kReplicates; ++r) {
      for (std::size_t block = 0; block < film.grid().count(); ++block) {
        BlockSums sums;
        for (auto& channel : sums.value) {
          for (double& value : channel) value = bright(random) ? 1.9 : 0.79;
        }
        film.add(r, block, sums, 1);
      }
    }
    const Certificate c = certificate_of(picture, film);
    held += c.error.mse_upper_95 >= 0.09 * 0.09 ? 1 : 0;
  }
  EXPECT_GE(held, 190);
}

TEST(Certificate, TilesShowWhereAPictureIsWrong) {
  const Image picture = with_local_error(truth(), 0.3F);
  const Certificate c = certificate_of(picture, noisy_film(3, 0.1, 0.5));
  // The error fills half of the leftmost tiles: mean square (0.3^2 + 2 * 0.15^2)/3 = 0.045 there.
  EXPECT_NEAR(c.tiles.at(0, 0)[1], 0.0225F, 0.003F);
  EXPECT_LT(c.tiles.at(40, 40)[1], 0.001F);
  EXPECT_EQ(c.tiles.at(0, 0)[0], c.tiles.at(15, 15)[0]);
}

// The mean over squares of five pixels.
Image blurred(const Image& image) {
  Image result(image.width(), image.height(), 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        float sum = 0.0F;
        for (int dy = -2; dy <= 2; ++dy) {
          for (int dx = -2; dx <= 2; ++dx) {
            sum += image.at(std::clamp(x + dx, 0, image.width() - 1),
                            std::clamp(y + dy, 0, image.height() - 1))[c];
          }
        }
        result.at(x, y)[c] = sum / 25.0F;
      }
    }
  }
  return result;
}

struct Shooting {
  explicit Shooting(const SimulationSpec& spec, const RayScene& scene)
      : shot{.scene = &scene,
             .camera = spec.camera,
             .sensor = sensor_of(spec.camera, spec.width, spec.height),
             .quality = spec.quality,
             .effects = spec.effects},
        camera(camera_of(shot.camera, shot.sensor)),
        source(sample_source(shot, camera, true)) {}
  Shot shot;
  Camera camera;
  SampleSource source;
};

TEST(Certificate, CatchesAPictureThatIsBlurredTooMuch) {
  Scene bars = wall_scene(5.0);
  add_bar(bars, -0.05, 0.02, 0.8, {0.95F, 0.1F, 0.1F});
  const RayScene scene(bars);
  const SimulationSpec spec = lens_shot(2.8, 96, 64);
  const Image reference = truth_of(spec, scene, 2048);
  const Shooting shooting(spec, scene);
  const Image wrong = blurred(reference);
  const double mse = mse_of(wrong, reference);
  const Certificate c = certified(wrong, shooting.source, {.mse = 1e-6, .tightness = 1.1}, {});
  EXPECT_GT(mse, 1e-3);
  // Two-sided 95 %; the reference's own error at 2,048 samples is far below.
  EXPECT_NEAR(c.error.mse, mse, 1.96 * c.standard_error);
  EXPECT_GE(c.error.mse_upper_95, mse);
  EXPECT_LE(c.error.mse_upper_95, 1.1 * c.error.mse);
  // The reference itself: nothing but scatter, a hundredth of the wrong picture's error.
  const Certificate right = certified(reference, shooting.source, {.mse = 0.01 * mse}, {});
  EXPECT_LE(right.error.mse_upper_95, 0.01 * mse);
}

TEST(Certificate, StopsWhenAsked) {
  const RayScene scene(wall_scene(5.0));
  const Shooting shooting(lens_shot(2.8, 96, 64), scene);
  std::stop_source stop;
  stop.request_stop();
  RunControl run;
  run.stop = stop.get_token();
  try {
    certified(Image(96, 64, 3), shooting.source, {}, run);
    FAIL() << "was not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace fstop
