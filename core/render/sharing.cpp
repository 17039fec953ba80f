#include "core/render/sharing.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fstop {
namespace {

// In units of those there are, by the law of the nets; what bias leaves no room for is infinite.
double samples_needed(const FilterCertificate& c, double goal) {
  const double room = goal - std::max(0.0, c.bias_squared);
  if (room <= 0.0) return std::numeric_limits<double>::infinity();
  return std::pow(c.variance / room, 1.0 / ReplicateFilm::kNetOrder);
}

}  // namespace

FilterKind Sharing::chosen_kind(const ReplicateFilm& film, double goal) const {
  // A plain mean of narrow windows is best where few samples do, parabolas where many must. Of
  // large pictures a quarter tells.
  constexpr FilterKind kMean{.keeps_parabolas = false, .share = 0.18};
  constexpr FilterKind kParabola{.keeps_parabolas = true, .share = 0.35};
  const int every = film.grid().height >= 256 ? 4 : 1;
  const auto needed = [&](const FilterKind& kind) {
    const DefocusFilter filter = filter_of(film, kind);
    if (!filter.does_something()) return std::numeric_limits<double>::infinity();
    return samples_needed(filter_certificate(filter, a_, b_, every, run_), goal);
  };
  return needed(kMean) < needed(kParabola) ? kMean : kParabola;
}

Judgement Sharing::judged(const ReplicateFilm& film, const NoiseEstimate& raw, double goal) {
  film.copy_replicate(0, a_, run_);
  film.copy_replicate(1, b_, run_);
  if (!kind_) kind_ = chosen_kind(film, goal);
  filter_.emplace(filter_of(film, *kind_));
  is_better_ = false;
  if (filter_->does_something()) {
    certificate_ = filter_certificate(*filter_, a_, b_, 1, run_);
    is_better_ = certificate_.mse_upper_95 < raw.mse_upper_95;
  }
  if (!is_better_) return {.noise = raw, .variance = raw.mse};
  Judgement result{.noise = raw, .variance = certificate_.variance};
  result.noise.mse = certificate_.mse;
  result.noise.mse_upper_95 = certificate_.mse_upper_95;
  return result;
}

std::vector<float> Sharing::shares(const BlockGrid& grid) const {
  std::vector<float> result(grid.count(), 1.0F);
  if (!is_better_) return result;
  for (std::size_t block = 0; block < grid.count(); ++block) {
    // An interleaved block lies in four of the filter's tiles, alike enough.
    const int middle = grid.stride(block) * (kBlockSide - 1) / 2;
    const int radius = filter_->radius((grid.left(block) + middle) / DefocusFilter::kTileSide,
                                       (grid.top(block) + middle) / DefocusFilter::kTileSide);
    result[block] = static_cast<float>(certificate_.gain[static_cast<std::size_t>(radius)]);
  }
  return result;
}

Image Sharing::picture() const {
  Image mean = a_;
  for (std::size_t i = 0; i < mean.pixels().size(); ++i) {
    mean.pixels()[i] = 0.5F * (mean.pixels()[i] + b_.pixels()[i]);
  }
  Image image = filter_->applied(mean, run_);
  for (float& value : image.pixels()) value = std::max(0.0F, value);  // weights below 0 undershoot
  return image;
}

int Sharing::widest() const {
  int radius = 0;
  for (int row = 0; row < filter_->rows(); ++row) {
    for (int column = 0; column < filter_->columns(); ++column) {
      radius = std::max(radius, filter_->radius(column, row));
    }
  }
  return 2 * radius + 1;
}

}  // namespace fstop
