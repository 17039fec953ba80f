#include "core/render/texture_detail.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/render/shot_facts.h"

namespace fstop {

double texture_lookup_width(const QualitySpec& quality) {
  if (quality.texture_width_px) return *quality.texture_width_px;
  return 0.125 * std::sqrt(std::min(1.0, quality.max_error / 0.01));
}

double texture_detail_rmse(const Image& image, double width, const RunControl& run) {
  return 0.5 * (width * width / 4.0) * curvature_of(image, run);
}

namespace {

constexpr int kCell = 8;  // pixels

// The largest blur radius of every cell and of its neighbours as far as discs reach.
class WidestDiscs {
 public:
  explicit WidestDiscs(const Image& coc)
      : columns_((coc.width() + kCell - 1) / kCell), rows_((coc.height() + kCell - 1) / kCell) {
    std::vector<float> own(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (int y = 0; y < coc.height(); ++y) {
      for (int x = 0; x < coc.width(); ++x) {
        float& cell = own[index(x / kCell, y / kCell)];
        cell = std::max(cell, std::abs(*coc.at(x, y)));
      }
    }
    widest_ = own;
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        const float disc = own[index(column, row)];
        const int reach = 1 + static_cast<int>(std::min(disc / (2.0F * kCell), 1e6F));
        for (int r = std::max(0, row - reach); r <= std::min(rows_ - 1, row + reach); ++r) {
          for (int c = std::max(0, column - reach); c <= std::min(columns_ - 1, column + reach);
               ++c) {
            float& other = widest_[index(c, r)];
            other = std::max(other, disc);
          }
        }
      }
    }
  }
  float at(int x, int y) const { return widest_[index(x / kCell, y / kCell)]; }

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  int columns_;
  int rows_;
  std::vector<float> widest_ = {};
};

}  // namespace

double texture_detail_rmse(const Image& image, double width, double disc_share, const Image& coc) {
  if (image.width() < 3 || image.height() < 3) return 0.0;
  const WidestDiscs discs(coc);
  const auto clipped = [&](int x, int y, int c) {
    return std::clamp(static_cast<double>(image.at(x, y)[c]), 0.0, 1.0);
  };
  double sum = 0.0;
  for (int y = 1; y + 1 < image.height(); ++y) {
    for (int x = 1; x + 1 < image.width(); ++x) {
      const double w = std::max(width, disc_share * static_cast<double>(discs.at(x, y)));
      const double half_variance = w * w / 8.0;
      for (int c = 0; c < image.channels(); ++c) {
        const double laplacian = clipped(x - 1, y, c) + clipped(x + 1, y, c) +
                                 clipped(x, y - 1, c) + clipped(x, y + 1, c) -
                                 4.0 * clipped(x, y, c);
        // No pixel of at most 1 is off by more.
        const double off = std::min(1.0, half_variance * std::abs(laplacian));
        sum += off * off;
      }
    }
  }
  return std::sqrt(
      sum / (static_cast<double>(image.channels()) * (image.width() - 2) * (image.height() - 2)));
}

}  // namespace fstop
