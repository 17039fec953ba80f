#include "core/render/depth_nodes.h"

#include <algorithm>
#include <cmath>

namespace fstop {
namespace {

constexpr double kStep = 1.5;
constexpr double kGrowth = 0.19;
constexpr double kKnee = 15.72;  // where 0.19 U^(3/4) passes 1.5

struct Interval {
  double begin = 0.0;
  double end = 0.0;
};

// Values with no gap of a whole step between neighbours make one interval.
std::vector<Interval> intervals_of(const std::vector<double>& sorted, double scale) {
  std::vector<Interval> intervals;
  for (const double value : sorted) {
    if (!intervals.empty() && value - intervals.back().end <= scale * defocus_step(value)) {
      intervals.back().end = value;
    } else {
      intervals.push_back({value, value});
    }
  }
  return intervals;
}

}  // namespace

double defocus_step(double defocus) noexcept {
  return std::max(kStep, kGrowth * std::pow(std::abs(defocus), 0.75));
}

double defocus_steps(double defocus) noexcept {
  const double u = std::abs(defocus);
  const double steps =
      u <= kKnee ? u / kStep
                 : kKnee / kStep + 4.0 / kGrowth * (std::pow(u, 0.25) - std::pow(kKnee, 0.25));
  return std::copysign(steps, defocus);
}

double defocus_after(double steps) noexcept {
  const double n = std::abs(steps);
  const double u = n <= kKnee / kStep
                       ? n * kStep
                       : std::pow(std::pow(kKnee, 0.25) + (n - kKnee / kStep) * kGrowth / 4.0, 4.0);
  return std::copysign(u, steps);
}

DepthNodes::DepthNodes(std::vector<double> values, double tolerance, int most, double largest)
    : step_scale_(std::sqrt(tolerance / 0.01)), least_(-largest), greatest_(largest) {
  std::erase_if(values, [&](double u) { return !(std::abs(u) <= largest); });
  if (values.empty()) values.push_back(0.0);
  std::ranges::sort(values);
  for (const Interval& interval : intervals_of(values, step_scale_)) {
    const double from = defocus_steps(interval.begin);
    const double steps = (defocus_steps(interval.end) - from) / step_scale_;
    if (steps < 0.1) {
      nodes_.push_back(0.5 * (interval.begin + interval.end));
      joined_.push_back(0);
      continue;
    }
    const int pieces = static_cast<int>(std::ceil(steps));
    for (int i = 0; i <= pieces; ++i) {
      nodes_.push_back(defocus_after(from + steps * step_scale_ * i / pieces));
      joined_.push_back(i < pieces ? 1 : 0);
    }
  }
  while (static_cast<int>(nodes_.size()) > most) {
    if (std::abs(nodes_.front()) > std::abs(nodes_.back())) {
      nodes_.erase(nodes_.begin());
      joined_.erase(joined_.begin());
      least_ = nodes_.front();
    } else {
      nodes_.pop_back();
      joined_.pop_back();
      joined_.back() = 0;
      greatest_ = nodes_.back();
    }
  }
}

bool DepthNodes::interpolates() const noexcept { return std::ranges::count(joined_, char{1}) > 0; }

double DepthNodes::reach() const noexcept {
  return std::min(std::abs(least_), std::abs(greatest_));
}

DepthNodes::Place DepthNodes::place(double defocus) const noexcept {
  const auto above = std::ranges::upper_bound(nodes_, defocus);
  const auto next = static_cast<std::size_t>(above - nodes_.begin());
  if (next == 0 || next == nodes_.size()) {
    // A little past a node that is the last of those kept is not yet beyond.
    const double slack = 0.1 * step_scale_ * defocus_step(defocus);
    if (defocus < least_ - slack || defocus > greatest_ + slack) return {};
    return nearest(defocus);
  }
  const std::size_t below = next - 1;
  if (joined_[below] == 0) return nearest(defocus);
  const double share = (defocus - nodes_[below]) / (nodes_[next] - nodes_[below]);
  return {.first = static_cast<int>(below), .second = static_cast<float>(share)};
}

DepthNodes::Place DepthNodes::nearest(double defocus) const noexcept {
  const auto above = std::ranges::upper_bound(nodes_, defocus);
  const auto next = static_cast<std::size_t>(above - nodes_.begin());
  if (next == 0) return {.first = 0};
  if (next == nodes_.size()) return {.first = static_cast<int>(next - 1)};
  const bool to_next = defocus - nodes_[next - 1] > nodes_[next] - defocus;
  return {.first = static_cast<int>(to_next ? next : next - 1)};
}

}  // namespace fstop
