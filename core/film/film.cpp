#include "core/film/film.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <type_traits>

#include "core/film/square_sums.h"

namespace fstop {
namespace {

double clipped(double value) { return std::clamp(value, 0.0, 1.0); }

}  // namespace

void SumPlane::Free::operator()(PixelSums* sums) const noexcept { std::free(sums); }

SumPlane::SumPlane(std::size_t size)
    : size_(size), sums_(static_cast<PixelSums*>(std::calloc(size, sizeof(PixelSums)))) {
  // All bits zero are sums of zero, so that the system's fresh pages need no second writing.
  static_assert(std::is_trivially_copyable_v<PixelSums>);
  if (!sums_ && size > 0) throw std::bad_alloc();
}

Film::Film(int width, int height)
    : width_(width),
      height_(height),
      total_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      pass_(total_.size()) {}

NoiseEstimate Film::end_pass(int samples) {
  SquareSums clipped_squares;
  SquareSums squares;
  double energy = 0.0;
  double energy_variance = 0.0;
  const bool halves = samples_ == samples;
  const double scale = 1.0 / samples;
  for (std::size_t i = 0; i < total_.size(); ++i) {
    double clipped_difference = 0.0;
    double difference = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double a = total_[i].value[c] * scale;
      const double b = pass_[i].value[c] * scale;
      // Over 3 channels, times 1/4.
      clipped_difference += std::pow(clipped(a) - clipped(b), 2) / 12.0;
      difference += (a - b) * (a - b) / 12.0;
      if (halves && !half_difference_.empty()) {
        half_difference_.pixels()[3 * i + c] = static_cast<float>(0.5 * (a - b));
      }
      energy += 0.5 * (a + b);
      energy_variance += 0.25 * (a - b) * (a - b);
      total_[i].value[c] += pass_[i].value[c];
      total_[i].square[c] += pass_[i].square[c];
    }
    pass_[i] = {};
    clipped_squares.add(clipped_difference);
    squares.add(difference);
  }
  samples_ += samples;
  if (!halves) return {};
  const auto pixels = static_cast<double>(total_.size());
  NoiseEstimate noise;
  noise.mse = clipped_squares.mean(pixels);
  noise.mse_upper_95 = clipped_squares.upper_95(pixels);
  noise.unclipped_mse_upper_95 = squares.upper_95(pixels);
  noise.energy = energy > 0.0 ? std::sqrt(energy_variance) / energy : 0.0;
  return noise;
}

Image Film::mean() const {
  Image image(width_, height_, 3);
  const double scale = samples_ > 0 ? 1.0 / samples_ : 0.0;
  for (std::size_t i = 0; i < total_.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      image.pixels()[3 * i + c] = static_cast<float>(total_[i].value[c] * scale);
    }
  }
  return image;
}

Image Film::variance() const {
  Image image(width_, height_, 3);
  if (samples_ < 2) return image;
  const double n = samples_;
  for (std::size_t i = 0; i < total_.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double mean = total_[i].value[c] / n;
      const double scatter = std::max(0.0, total_[i].square[c] / n - mean * mean);
      image.pixels()[3 * i + c] = static_cast<float>(scatter / (n - 1.0));
    }
  }
  return image;
}

}  // namespace fstop
