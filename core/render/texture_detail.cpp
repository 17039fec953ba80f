#include "core/render/texture_detail.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <vector>

#include "core/render/shot_facts.h"

namespace fstop {
namespace {

constexpr int kCell = 8;  // pixels

// Replaces each of `count` values, `stride` apart, by the largest within `reach` of it.
void spread(float* values, int count, int stride, int reach, std::vector<float>& line) {
  line.resize(static_cast<std::size_t>(count));
  const auto at = [&](int i) -> float& { return values[static_cast<std::ptrdiff_t>(i) * stride]; };
  for (int i = 0; i < count; ++i) line[static_cast<std::size_t>(i)] = at(i);
  const auto old = [&](int i) { return line[static_cast<std::size_t>(i)]; };
  std::deque<int> falling;  // of the window, with no larger value behind them
  for (int i = 0, next = 0; i < count; ++i) {
    for (; next < count && next - i <= reach; ++next) {
      while (!falling.empty() && old(falling.back()) <= old(next)) falling.pop_back();
      falling.push_back(next);
    }
    while (i - falling.front() > reach) falling.pop_front();
    at(i) = old(falling.front());
  }
}

// For every cell of 8 x 8 pixels the diameter of the widest disc that may reach it. Discs are
// spread by the powers of two above their reach, so that the work grows with the logarithm of the
// largest.
class WidestDiscs {
 public:
  explicit WidestDiscs(const Image& coc)
      : columns_((coc.width() + kCell - 1) / kCell), rows_((coc.height() + kCell - 1) / kCell) {
    widest_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (int y = 0; y < coc.height(); ++y) {
      for (int x = 0; x < coc.width(); ++x) {
        float& cell = widest_[index(x / kCell, y / kCell)];
        cell = std::max(cell, std::abs(*coc.at(x, y)));
      }
    }
    const std::vector<float> own = widest_;
    const int farthest = std::max(columns_, rows_);
    std::vector<float> some;
    std::vector<float> line;
    for (int least = 0, most = 1; least < farthest; least = most, most *= 2) {
      const bool is_last = most >= farthest;
      some.assign(own.size(), 0.0F);
      bool any = false;
      for (std::size_t i = 0; i < own.size(); ++i) {
        const float reach = 1.0F + own[i] / (2.0F * kCell);  // cells
        if (!(reach > static_cast<float>(least)) || (!is_last && reach > static_cast<float>(most)))
          continue;
        some[i] = own[i];
        any = true;
      }
      if (!any) continue;
      for (int row = 0; row < rows_; ++row) spread(&some[index(0, row)], columns_, 1, most, line);
      for (int column = 0; column < columns_; ++column)
        spread(&some[index(column, 0)], rows_, columns_, most, line);
      for (std::size_t i = 0; i < own.size(); ++i) widest_[i] = std::max(widest_[i], some[i]);
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

double texture_lookup_width(const QualitySpec& quality) {
  if (quality.texture_width_px) return *quality.texture_width_px;
  return 0.125 * std::sqrt(std::min(1.0, quality.max_error / 0.01));
}

double texture_detail_rmse(const Image& image, double width, const RunControl& run) {
  const double told = std::min(1.0, 0.5 * (width * width / 4.0) * curvature_of(image, run));
  // A picture that is blurred so widely shows little of what it has lost. No mean of values from 0
  // to 1 is farther from them than half.
  constexpr double kWidestThatTells = 2.0;  // px
  return width > kWidestThatTells ? std::max(told, 0.5) : told;
}

double texture_detail_rmse(const Image& image, double width, double disc_share, const Image& coc,
                           const RunControl& run) {
  if (image.width() < 3 || image.height() < 3) return 0.0;
  const WidestDiscs discs(coc);
  const auto clipped = [&](int x, int y, int c) {
    return std::clamp(static_cast<double>(image.at(x, y)[c]), 0.0, 1.0);
  };
  std::vector<double> rows(static_cast<std::size_t>(image.height()));
  parallel_for(run, image.height() - 2, [&](int above) {
    const int y = above + 1;
    double sum = 0.0;
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
    rows[static_cast<std::size_t>(y)] = sum;
  });
  return std::sqrt(
      std::accumulate(rows.begin(), rows.end(), 0.0) /
      (static_cast<double>(image.channels()) * (image.width() - 2) * (image.height() - 2)));
}

}  // namespace fstop
