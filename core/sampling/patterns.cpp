#include "core/sampling/patterns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/sampling/sequence.h"

namespace fstop {
namespace {

// Of the densest packing's distance, at first; what random darts reach lies below.
constexpr double kFirstRadius = 0.85;
constexpr double kShrink = 0.98;
constexpr int kDartsPerPoint = 40;  // that may miss before the distance shrinks

// A stream of numbers in [0, 1).
class Random {
 public:
  explicit Random(std::uint32_t seed) : seed_(seed) {}
  double operator()() { return hash_of(seed_, count_++) * 0x1p-32; }

 private:
  std::uint32_t seed_;
  std::uint32_t count_ = 0;
};

double around(double distance) {  // on a circle of length 1
  const double ahead = std::abs(distance);
  return std::min(ahead, 1.0 - ahead);
}

using Point = std::array<double, 2>;

double distance_of(const Point& a, const Point& b) {
  return std::hypot(around(a[0] - b[0]), around(a[1] - b[1]));
}

double densest_distance(std::size_t count) {
  return std::sqrt(2.0 / (std::numbers::sqrt3 * static_cast<double>(count)));
}

void require_count(int count) {
  if (count >= 1 && count <= kMostPatternSamples) return;
  throw Error(ErrorCode::outside_domain,
              "a sampling pattern has 1 to " + std::to_string(kMostPatternSamples) + " points");
}

[[noreturn]] void refuse_sequence() {
  throw Error(ErrorCode::outside_domain, "the low-discrepancy sequence is no set of points");
}

// Points on the unit torus, sorted into square cells no smaller than `reach`.
class Neighbourhood {
 public:
  explicit Neighbourhood(double reach)
      : cells_(std::clamp(static_cast<int>(1.0 / reach), 1, kMostCells)),
        members_(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_)) {}

  void add(const Point& point) {
    members_[cell(index(point[0]), index(point[1]))].push_back(point);
  }

  /// Whether one lies nearer than `radius`, at most `reach`.
  bool has_near(const Point& point, double radius) const {
    for (int row = -1; row <= 1; ++row) {
      for (int column = -1; column <= 1; ++column) {
        const auto& others = members_[cell(index(point[0]) + column, index(point[1]) + row)];
        if (std::ranges::any_of(
                others, [&](const Point& other) { return distance_of(point, other) < radius; }))
          return true;
      }
    }
    return false;
  }

 private:
  static constexpr int kMostCells = 64;  // along each side: points on a line need no more

  int index(double coordinate) const {
    return std::min(cells_ - 1, static_cast<int>(coordinate * cells_));
  }
  std::size_t cell(int column, int row) const {
    const auto around_edge = [&](int i) { return static_cast<std::size_t>((i + cells_) % cells_); };
    return around_edge(row) * static_cast<std::size_t>(cells_) + around_edge(column);
  }

  int cells_;  // along each side
  std::vector<std::vector<Point>> members_;
};

// Darts that keep `radius`, which shrinks where they find no place.
template <typename Dart>
std::vector<Point> spread_darts(int count, double radius, const Dart& dart) {
  std::vector<Point> points;
  Neighbourhood neighbours(radius);
  int misses = 0;
  while (static_cast<int>(points.size()) < count) {
    const Point point = dart();
    if (!neighbours.has_near(point, radius)) {
      points.push_back(point);
      neighbours.add(point);
      misses = 0;
    } else if (++misses > kDartsPerPoint * count) {
      radius *= kShrink;
      misses = 0;
    }
  }
  return points;
}

double wrapped(double value) {
  const double inside = value - std::floor(value);
  return inside < 1.0 ? inside : 0.0;
}

}  // namespace

std::vector<Point> pattern_points(SamplePattern pattern, int count, std::uint32_t seed) {
  require_count(count);
  Random random(seed);
  const auto dart = [&] {
    const double x = random();
    return Point{x, random()};
  };
  int rows = static_cast<int>(std::sqrt(static_cast<double>(count)));
  while (count % rows != 0) --rows;
  const int columns = count / rows;
  std::vector<Point> points;
  switch (pattern) {
    case SamplePattern::regular:
    case SamplePattern::jittered:
      for (int i = 0; i < count; ++i) {
        const Point in_cell = pattern == SamplePattern::regular ? Point{0.5, 0.5} : dart();
        points.push_back({(i % columns + in_cell[0]) / columns, (i / columns + in_cell[1]) / rows});
      }
      return points;
    case SamplePattern::poisson:
      for (int i = 0; i < count; ++i) points.push_back(dart());
      return points;
    case SamplePattern::poisson_disc:
      return spread_darts(count, kFirstRadius * densest_distance(static_cast<std::size_t>(count)),
                          dart);
    case SamplePattern::low_discrepancy:
      break;
  }
  refuse_sequence();
}

std::vector<double> pattern_times(SamplePattern pattern, int count, std::uint32_t seed) {
  require_count(count);
  Random random(seed);
  std::vector<double> times;
  switch (pattern) {
    case SamplePattern::regular:
    case SamplePattern::jittered:
      for (int i = 0; i < count; ++i) {
        times.push_back((i + (pattern == SamplePattern::regular ? 0.5 : random())) / count);
      }
      return times;
    case SamplePattern::poisson:
      for (int i = 0; i < count; ++i) times.push_back(random());
      return times;
    case SamplePattern::poisson_disc:
      for (const Point& point : spread_darts(count, kFirstRadius / count, [&] {
             return Point{random(), 0.0};
           }))
        times.push_back(point[0]);
      return times;
    case SamplePattern::low_discrepancy:
      break;
  }
  refuse_sequence();
}

double relative_radius(const std::vector<Point>& points) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      nearest = std::min(nearest, distance_of(points[i], points[k]));
    }
  }
  return nearest / densest_distance(points.size());
}

// A hash that stays within the next power of two is a permutation of it; indices beyond `count` are
// sent on until they come back inside.
std::uint32_t permuted(std::uint32_t index, std::uint32_t count, std::uint32_t key) noexcept {
  std::uint32_t mask = count - 1;
  for (const unsigned shift : {1U, 2U, 4U, 8U, 16U}) mask |= mask >> shift;
  std::uint32_t i = index;
  do {
    i ^= key;
    i *= 0xe170893dU;
    i ^= key >> 16;
    i ^= (i & mask) >> 4;
    i ^= key >> 8;
    i *= 0x0929eb3fU;
    i ^= key >> 23;
    i ^= (i & mask) >> 1;
    i *= 1U | key >> 27;
    i *= 0x6935fa69U;
    i ^= (i & mask) >> 11;
    i *= 0x74dcb303U;
    i ^= (i & mask) >> 2;
    i *= 0x9e501cc3U;
    i ^= (i & mask) >> 2;
    i *= 0xc860a3dfU;
    i &= mask;
    i ^= i >> 5;
  } while (i >= count);
  return (i + key) % count;
}

PatternTables::PatternTables(const PatternChoice& choice, int count, std::uint32_t seed)
    : seed_(seed) {
  const std::array<SamplePattern, 3> patterns = {choice.pixel, choice.lens, choice.time};
  for (std::uint32_t pair = 0; pair < 3; ++pair) {
    if (patterns[pair] == SamplePattern::low_discrepancy) continue;
    const std::uint32_t own = hash_of(seed, 0x9a77e400U + pair);
    is_regular_[pair] = patterns[pair] == SamplePattern::regular;
    if (static_cast<Pair>(pair) != Pair::time) {
      tables_[pair] = pattern_points(patterns[pair], count, own);
      continue;
    }
    for (const double time : pattern_times(patterns[pair], count, own)) {
      tables_[pair].push_back({time, 0.0});
    }
  }
}

double PatternTables::value(Pair pair, int axis, std::uint32_t pixel,
                            std::uint32_t index) const noexcept {
  const auto number = static_cast<std::uint32_t>(pair);
  const std::vector<Point>& points = table(pair);
  const auto count = static_cast<std::uint32_t>(points.size());
  const std::uint32_t order = hash_of(hash_of(seed_, number), pixel);
  const std::uint32_t whose = is_regular_[number] ? 0U : pixel;
  const std::uint32_t place =
      hash_of(hash_of(seed_, 0x0ff5e700U + 2 * number + static_cast<std::uint32_t>(axis)), whose);
  const double offset = place * 0x1p-32;
  const double point =
      points[permuted(index % count, count, order)][static_cast<std::size_t>(axis)];
  return wrapped(point + offset);
}

}  // namespace fstop
