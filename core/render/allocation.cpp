#include "core/render/allocation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fstop {
namespace {

// Below this share of the mean spread a block is as good as flat: it keeps a tenth of the mean
// count, so that what was not seen yet has a chance.
constexpr double kLeastSpread = 0.005;

// The steps of counts: 1, 1, 2, 3, 4, 6, 8, 12, ... and each one's n^-t.
struct Steps {
  static constexpr int kCount = 34;
  std::array<std::uint32_t, kCount> count = {};
  std::array<double, kCount> error = {};
  explicit Steps(double order) {
    for (int i = 0; i < kCount; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const std::uint32_t power = 1U << (i / 2);
      count[k] = i % 2 == 0 ? power : std::max(1U, power + power / 2);
      error[k] = std::pow(count[k], -order);
    }
  }
  // The first step of at least `samples`.
  int at_least(double samples) const {
    const auto found =
        std::ranges::lower_bound(count, samples, {}, [](std::uint32_t c) { return double(c); });
    return static_cast<int>(std::min<std::ptrdiff_t>(found - count.begin(), kCount - 1));
  }
};

// One block of one replicate.
struct Candidate {
  float spread = 0.0F;    // V
  float log_wish = 0.0F;  // 2 log2 of V^(1/(1+t))
  int now = 0;            // step
  int most = 0;           // step, in this round
  int end = 0;            // step, ever
  int pixels = 0;
  bool exact = true;  // the count now is the step's
};

// Spreads as seen by the 3 x 3 blocks around, weighted 1 2 1.
std::vector<float> smoothed(const ReplicateFilm& film, int replicate) {
  const BlockGrid& grid = film.grid();
  std::vector<float> result(grid.count());
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      float sum = 0.0F;
      float weights = 0.0F;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int x = column + dx;
          const int y = row + dy;
          if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows) continue;
          const float spread = film.spread(replicate, grid.index(x, y));
          if (spread < 0.0F) continue;
          const auto weight = static_cast<float>((2 - dx * dx) * (2 - dy * dy));
          sum += weight * spread;
          weights += weight;
        }
      }
      result[grid.index(column, row)] = weights > 0.0F ? sum / weights : 0.0F;
    }
  }
  return result;
}

class Allocator {
 public:
  Allocator(const ReplicateFilm& film, const AllocationGoal& goal)
      : film_(film), goal_(goal), steps_(goal.order) {
    for (int r = 0; r < kReplicates; ++r) add_replicate(r);
    for (const auto& c : candidates_) {
      now_ += double(c.pixels) * static_cast<double>(c.spread) *
              steps_.error[static_cast<std::size_t>(c.now)];
    }
  }

  Allocation find() const {
    // The scale's logarithm, in half octaves: from no block wanting more than one sample to every
    // block wanting the most.
    double low = -static_cast<double>(most_wish_) - 1.0;
    double high = Steps::kCount - static_cast<double>(least_wish_);
    for (int i = 0; i < 14; ++i) {
      const double middle = 0.5 * (low + high);
      const Outcome outcome = at(middle);
      // What the round's growth holds back is not made up for where it helps less.
      const bool enough = outcome.last_mse <= goal_.mse || outcome.samples > goal_.budget;
      (enough ? high : low) = middle;
    }
    const Outcome reached = at(high);
    return with_scale(reached.samples > goal_.budget ? low : high);
  }

 private:
  struct Outcome {
    double mse = 0.0;
    double last_mse = 0.0;  // once further rounds have given what this one's growth holds back
    double samples = 0.0;
    double last_samples = 0.0;
  };

  void add_replicate(int replicate) {
    std::vector<float> spreads = smoothed(film_, 1 - replicate);
    if (goal_.shares != nullptr) {
      for (std::size_t block = 0; block < spreads.size(); ++block) {
        spreads[block] *= (*goal_.shares)[block];
      }
    }
    double mean = 0.0;
    for (const float v : spreads) mean += static_cast<double>(v);
    mean /= static_cast<double>(spreads.size());
    const float least = static_cast<float>(std::max(kLeastSpread * mean, 1e-30));
    for (std::size_t block = 0; block < spreads.size(); ++block) {
      const std::uint32_t count = film_.samples(replicate, block);
      Candidate c{.spread = std::max(spreads[block], least), .pixels = film_.grid().pixels(block)};
      c.log_wish = static_cast<float>(2.0 / (1.0 + goal_.order)) * std::log2(c.spread);
      least_wish_ = std::min(least_wish_, c.log_wish);
      most_wish_ = std::max(most_wish_, c.log_wish);
      c.now = steps_.at_least(count);
      const double most = std::min(goal_.most_growth * count, double(goal_.most_samples));
      c.most = std::max(c.now, steps_.at_least(most));
      c.end = std::max(c.now, steps_.at_least(double(goal_.most_samples)));
      c.exact = steps_.count[static_cast<std::size_t>(c.now)] == count;
      candidates_.push_back(c);
    }
  }

  static double wish(const Candidate& c, double scale) {
    return std::ceil(scale + static_cast<double>(c.log_wish));
  }
  // In this round.
  static int step(const Candidate& c, double scale) {
    return static_cast<int>(std::clamp(wish(c, scale), double(c.now), double(c.most)));
  }

  Outcome at(double scale) const {
    Outcome outcome;
    double error = 0.0;
    double last_error = 0.0;
    for (const Candidate& c : candidates_) {
      const auto next = static_cast<std::size_t>(step(c, scale));
      const auto last =
          static_cast<std::size_t>(std::clamp(wish(c, scale), double(c.now), double(c.end)));
      const double spread = c.pixels * static_cast<double>(c.spread);
      error += spread * steps_.error[next];
      last_error += spread * steps_.error[last];
      const double now = steps_.count[static_cast<std::size_t>(c.now)];
      outcome.samples += double(c.pixels) * (double(steps_.count[next]) - now);
      outcome.last_samples += double(c.pixels) * (double(steps_.count[last]) - now);
    }
    const double per_error = now_ > 0.0 ? goal_.measured / now_ : 0.0;
    outcome.mse = per_error * error;
    outcome.last_mse = per_error * last_error;
    return outcome;
  }

  Allocation with_scale(double scale) const {
    Allocation result;
    const std::size_t blocks = film_.grid().count();
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const Candidate& c = candidates_[i];
      const int next = step(c, scale);
      const std::uint32_t now = film_.samples(static_cast<int>(i / blocks), i % blocks);
      const std::uint32_t wanted = steps_.count[static_cast<std::size_t>(next)];
      result.counts[i / blocks].push_back(next == c.now && !c.exact ? now : std::max(now, wanted));
    }
    const Outcome outcome = at(scale);
    result.predicted_mse = outcome.mse;
    result.samples = outcome.samples;
    result.last_samples = outcome.last_samples;
    return result;
  }

  const ReplicateFilm& film_;
  const AllocationGoal& goal_;
  Steps steps_;
  std::vector<Candidate> candidates_ = {};
  double now_ = 0.0;
  float least_wish_ = std::numeric_limits<float>::infinity();
  float most_wish_ = -std::numeric_limits<float>::infinity();
};

}  // namespace

Allocation allocated(const ReplicateFilm& film, const AllocationGoal& goal) {
  return Allocator(film, goal).find();
}

}  // namespace fstop
