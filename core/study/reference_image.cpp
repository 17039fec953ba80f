#include "core/study/reference_image.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"

namespace fstop {

void ReferenceImage::Moments::add(double value, int count) noexcept {
  const double from_old = value - mean;
  mean += from_old / count;
  squares += from_old * (value - mean);
}

void ReferenceImage::add(const Image& picture) {
  if (replicates_ == 0) {
    width_ = picture.width();
    height_ = picture.height();
    values_.resize(picture.pixels().size());
    clipped_.resize(picture.pixels().size());
  }
  if (picture.pixels().size() != values_.size()) {
    throw Error(ErrorCode::internal, "replicates of a reference must have one size");
  }
  ++replicates_;
  double total = 0.0;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const double value = picture.pixels()[i];
    values_[i].add(value, replicates_);
    clipped_[i].add(std::clamp(value, 0.0, 1.0), replicates_);
    total += value;
  }
  energy_.add(total, replicates_);
}

Image ReferenceImage::mean() const {
  Image image(width_, height_, 3);
  std::ranges::transform(values_, image.pixels().begin(),
                         [](const Moments& m) { return static_cast<float>(m.mean); });
  return image;
}

double ReferenceImage::variance_of_mean(const Moments& moments) const noexcept {
  return moments.squares / (static_cast<double>(replicates_ - 1) * replicates_);
}

double ReferenceImage::clipped_variance() const {
  const double sum = std::accumulate(
      clipped_.begin(), clipped_.end(), 0.0,
      [&](double so_far, const Moments& m) { return so_far + variance_of_mean(m); });
  return sum / static_cast<double>(clipped_.size());
}

double ReferenceImage::relative_variance() const {
  const double sum =
      std::accumulate(values_.begin(), values_.end(), 0.0, [&](double so_far, const Moments& m) {
        return so_far + variance_of_mean(m) / (m.mean * m.mean + 0.01);
      });
  return sum / static_cast<double>(values_.size());
}

double ReferenceImage::energy_error() const {
  if (energy_.mean == 0.0) return 0.0;
  return std::sqrt(variance_of_mean(energy_)) / std::abs(energy_.mean);
}

}  // namespace fstop
