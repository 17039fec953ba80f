#include "core/render/certificate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "core/render/sample_loop.h"

namespace fstop {
namespace {

// One-sided 95 % quantile of Student's distribution for whole degrees of freedom.
double student_95(double freedom) {
  constexpr std::array<double, 10> kSmall = {6.3138, 2.9200, 2.3534, 2.1318, 2.0150,
                                             1.9432, 1.8946, 1.8595, 1.8331, 1.8125};
  const double whole = std::floor(std::max(1.0, freedom));
  if (whole <= 10.0) return kSmall[static_cast<std::size_t>(whole) - 1];
  // Cornish-Fisher: Abramowitz & Stegun 26.7.5, two terms.
  constexpr double z = 1.6448536269514722;
  return z + (z * z * z + z) / (4.0 * whole) +
         (5.0 * std::pow(z, 5) + 16.0 * z * z * z + 3.0 * z) / (96.0 * whole * whole);
}

// Sums over the pixels and channels of a block.
struct Residuals {
  double product = 0.0;  // (X - U1)(X - U2)
  double first = 0.0;    // (X - U1)^2
  double second = 0.0;   // (X - U2)^2
  double spread = 0.0;   // (U1 - U2)^2

  void add(double x, double u1, double u2) noexcept {
    product += (x - u1) * (x - u2);
    first += (x - u1) * (x - u1);
    second += (x - u2) * (x - u2);
    spread += (u1 - u2) * (u1 - u2);
  }
  // Estimates the variance of `product`.
  double variance() const noexcept {
    return 0.25 * (first - second) * (first - second) + spread * spread / 8.0;
  }
};

// The mean of products over blocks, with its scatter.
struct ProductMean {
  double mean = 0.0;  // per value
  double standard_error = 0.0;
  double upper_95 = 0.0;
};

// Sums of variances, and how many blocks they effectively come from.
struct VarianceSum {
  double sum = 0.0;
  double squares = 0.0;

  void add(double variance) noexcept {
    sum += variance;
    squares += variance * variance;
  }
  double freedom() const noexcept { return squares > 0.0 ? sum * sum / squares : 1.0; }
};

ProductMean mean_of(const std::vector<Residuals>& blocks, double values) {
  ProductMean result;
  VarianceSum variance;
  for (const Residuals& block : blocks) {
    result.mean += block.product;
    variance.add(block.variance());
  }
  result.mean /= values;
  result.standard_error = std::sqrt(variance.sum) / values;
  result.upper_95 =
      std::max(0.0, result.mean) + student_95(variance.freedom()) * result.standard_error;
  return result;
}

// Whether samples enough were traced.
bool meets(const NoiseEstimate& error, const CertificateGoal& goal) {
  const double bound = error.mse_upper_95;
  if (bound <= goal.tightness * error.mse) return true;
  return bound <= goal.mse && (bound <= 4.0 * error.mse || bound <= goal.mse / 16.0);
}

double clipped(double value) { return std::clamp(value, 0.0, 1.0); }

// Estimates the square of what clipping takes from the mean of a replicate.
double clip_square(double u1, double u2) {
  const auto beyond = [](double u) { return std::clamp(u - 1.0, 0.0, 1.0); };
  return 0.5 * (beyond(u1) * (1.0 - clipped(u2)) + beyond(u2) * (1.0 - clipped(u1)));
}

// Both replicates and the picture, pixel by pixel.
class Comparison {
 public:
  Comparison(const Image& picture, const ReplicateFilm& film)
      : picture_(picture), first_(film.replicate(0)), second_(film.replicate(1)), film_(film) {}

  Certificate certificate() {
    const BlockGrid& grid = film_.grid();
    clipped_.resize(grid.count());
    unclipped_.resize(grid.count());
    for (std::size_t block = 0; block < grid.count(); ++block) add(block);
    const double values = 3.0 * grid.width * grid.height;
    const ProductMean mse = mean_of(clipped_, values);
    const double hidden = std::sqrt(clip_square_ / values);
    Certificate result;
    result.error.mse = std::max(0.0, mse.mean);
    result.error.mse_upper_95 = std::pow(std::sqrt(mse.upper_95) + hidden, 2);
    result.error.unclipped_mse_upper_95 = mean_of(unclipped_, values).upper_95;
    result.error.energy = energy();
    result.standard_error = mse.standard_error;
    result.clip_bias = hidden;
    result.tiles = tiles();
    return result;
  }

 private:
  void add(std::size_t block) {
    double off = 0.0;
    film_.grid().for_each_pixel(block, [&](std::size_t, int x, int y) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto p = static_cast<double>(picture_.at(x, y)[c]);
        const auto u1 = static_cast<double>(first_.at(x, y)[c]);
        const auto u2 = static_cast<double>(second_.at(x, y)[c]);
        clipped_[block].add(clipped(p), clipped(u1), clipped(u2));
        unclipped_[block].add(p, u1, u2);
        if (p < 1.0) clip_square_ += clip_square(u1, u2);
        picture_energy_ += p;
        energy_ += 0.5 * (u1 + u2);
        off += 0.5 * (u1 - u2);
      }
    });
    energy_variance_ += off * off;
  }

  double energy() const {
    if (!(energy_ > 0.0)) return picture_energy_ > 0.0 ? 1.0 : 0.0;
    return (std::abs(picture_energy_ - energy_) + std::sqrt(energy_variance_)) / energy_;
  }

  double tile_product(int left, int top, int right, int bottom, std::size_t c) const {
    double sum = 0.0;
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        const double p = clipped(static_cast<double>(picture_.at(x, y)[c]));
        sum += (p - clipped(static_cast<double>(first_.at(x, y)[c]))) *
               (p - clipped(static_cast<double>(second_.at(x, y)[c])));
      }
    }
    return sum / (static_cast<double>(right - left) * (bottom - top));
  }

  // A tile's own estimate scatters and may fall below 0: then 0 is shown.
  Image tiles() const {
    Image image(picture_.width(), picture_.height(), 3);
    for (int top = 0; top < image.height(); top += kErrorTile) {
      const int bottom = std::min(image.height(), top + kErrorTile);
      for (int left = 0; left < image.width(); left += kErrorTile) {
        const int right = std::min(image.width(), left + kErrorTile);
        for (std::size_t c = 0; c < 3; ++c) {
          const double mse = std::max(0.0, tile_product(left, top, right, bottom, c));
          for (int y = top; y < bottom; ++y) {
            for (int x = left; x < right; ++x) image.at(x, y)[c] = static_cast<float>(mse);
          }
        }
      }
    }
    return image;
  }

  const Image& picture_;
  Image first_;
  Image second_;
  const ReplicateFilm& film_;
  std::vector<Residuals> clipped_ = {};
  std::vector<Residuals> unclipped_ = {};
  double clip_square_ = 0.0;
  double picture_energy_ = 0.0;
  double energy_ = 0.0;
  double energy_variance_ = 0.0;
};

// Adds samples [first, first + count) of every pixel to both replicates; returns the rays.
std::uint64_t trace(const std::array<SampleSource, kReplicates>& sources, std::uint32_t first,
                    std::uint32_t count, ReplicateFilm& film, const RunControl& run) {
  const BlockGrid& grid = film.grid();
  const int columns = (grid.width + kTile - 1) / kTile;
  const int rows = (grid.height + kTile - 1) / kTile;
  std::atomic<std::uint64_t> rays = 0;
  parallel_for(run, columns * rows, [&](int tile) {
    for_each_block(grid, tile % columns, tile / columns, [&](std::size_t block) {
      if (run.stop.stop_requested()) return;
      for (int r = 0; r < kReplicates; ++r) {
        BlockSums sums;
        BlockTracer tracer(sources[static_cast<std::size_t>(r)], grid, block);
        rays += tracer.trace(first, count, sums);
        film.add(r, block, sums, count);
      }
    });
  });
  throw_if_stopped(run);
  return rays;
}

SampleSource with_seed(SampleSource source, std::uint32_t seed) {
  source.sequence = SampleSequence(seed);
  return source;
}

}  // namespace

Certificate certificate_of(const Image& picture, const ReplicateFilm& film) {
  return Comparison(picture, film).certificate();
}

Certificate certified(const Image& picture, const SampleSource& source, const CertificateGoal& goal,
                      const RunControl& run) {
  const std::array<SampleSource, kReplicates> sources = {
      with_seed(source, hash_of(goal.seed, 0xce270001U)),
      with_seed(source, hash_of(goal.seed, 0xce270002U))};
  ReplicateFilm film(picture.width(), picture.height());
  std::uint64_t rays = 0;
  std::uint32_t done = 0;
  for (std::uint32_t next = kFirstCertificate;; next = done) {
    rays += trace(sources, done, next, film, run);
    done += next;
    Certificate result = certificate_of(picture, film);
    if (!meets(result.error, goal) && 2 * done <= goal.most_samples) continue;
    result.rays = rays;
    result.samples = done;
    return result;
  }
}

}  // namespace fstop
