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

Judgement Sharing::judged(const ReplicateFilm& film, const NoiseEstimate& raw, double goal) {
  const Image a = film.replicate(0, run_);
  const Image b = film.replicate(1, run_);
  if (!chosen_) {
    // A plain mean of narrow windows is best where few samples do, parabolas where many must.
    Try mean = tried(film, a, b, {.keeps_parabolas = false, .share = 0.18});
    Try parabola = tried(film, a, b, {.keeps_parabolas = true, .share = 0.35});
    chosen_ = samples_needed(mean.certificate, goal) < samples_needed(parabola.certificate, goal)
                  ? mean.kind
                  : parabola.kind;
    last_ = std::move(chosen_->keeps_parabolas ? parabola : mean);
  } else {
    last_ = tried(film, a, b, *chosen_);
  }
  const FilterCertificate& c = last_.certificate;
  is_better_ = last_.filter && c.mse_upper_95 < raw.mse_upper_95;
  if (!is_better_) return {.noise = raw, .variance = raw.mse};
  Judgement result{.noise = raw, .variance = c.variance};
  result.noise.mse = c.mse;
  result.noise.mse_upper_95 = c.mse_upper_95;
  return result;
}

std::vector<float> Sharing::shares(const BlockGrid& grid) const {
  std::vector<float> result(grid.count(), 1.0F);
  if (!is_better_) return result;
  for (std::size_t block = 0; block < grid.count(); ++block) {
    const int radius = last_.filter->radius(grid.left(block) / DefocusFilter::kTileSide,
                                            grid.top(block) / DefocusFilter::kTileSide);
    result[block] = static_cast<float>(last_.certificate.gain[static_cast<std::size_t>(radius)]);
  }
  return result;
}

Image Sharing::picture() const {
  Image image = last_.a;
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    // Weights below 0 may undershoot black.
    image.pixels()[i] = std::max(0.0F, 0.5F * (last_.a.pixels()[i] + last_.b.pixels()[i]));
  }
  return image;
}

int Sharing::widest() const {
  int radius = 0;
  for (int row = 0; row < last_.filter->rows(); ++row) {
    for (int column = 0; column < last_.filter->columns(); ++column) {
      radius = std::max(radius, last_.filter->radius(column, row));
    }
  }
  return 2 * radius + 1;
}

Sharing::Try Sharing::tried(const ReplicateFilm& film, const Image& a, const Image& b,
                            const FilterKind& kind) const {
  Try result{.kind = kind};
  result.filter.emplace(film, a, b, blur_px_, kind, run_);
  if (!result.filter->does_something()) {
    result.filter.reset();
    result.certificate.mse = result.certificate.mse_upper_95 = result.certificate.variance =
        std::numeric_limits<double>::infinity();
    return result;
  }
  result.a = result.filter->applied(a, run_);
  result.b = result.filter->applied(b, run_);
  result.certificate = filter_certificate(*result.filter, a, b, result.a, result.b, run_);
  return result;
}

}  // namespace fstop
