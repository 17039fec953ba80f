#include "core/post/halftone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.h"

namespace fstop {
namespace {

constexpr int kMostLevels = 256;

void require_cell(double n) {
  if (!(n >= 2.0 && n <= kLargestCell)) {
    throw Error(ErrorCode::outside_domain,
                "a halftone cell has 2 to " + std::to_string(kLargestCell) + " pixels a side");
  }
}

int whole_cell(double cell) {
  require_cell(cell);
  if (cell != std::floor(cell)) {
    throw Error(ErrorCode::outside_domain, "a cell of ordered dither has a whole number of pixels");
  }
  return static_cast<int>(cell);
}

// A pixel of a cell as its growth sees it: four times the squared distance from the centre, which
// is whole, and the angle clockwise from the left.
struct Place {
  int distance = 0;
  double turn = 0.0;
  friend auto operator<=>(const Place&, const Place&) = default;
};

std::vector<Place> places(int n) {
  std::vector<Place> result;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const int dx = 2 * x - (n - 1);
      const int dy = 2 * y - (n - 1);
      const double turn = std::atan2(-static_cast<double>(dy), -static_cast<double>(dx));
      result.push_back({dx * dx + dy * dy, turn < 0.0 ? turn + 2.0 * std::numbers::pi : turn});
    }
  }
  return result;
}

// The phase of the dots. Where they and the pixels have a common period, a pixel meets few phases,
// and at 0 or 1/4 several of them were equally bright: fewer levels. At these none are.
constexpr double kPhaseAcross = 0.137;
constexpr double kPhaseDown = 0.281;

// How many pixels a side are looked at to learn how bright the dots are.
constexpr int kLookedAt = 256;
// What differs by less is equally bright: sums of two cosines round by some 1e-13.
constexpr double kEquallyBright = 1e-9;

// Weights, adding up to 1, that fall to 0 towards the ends: a sum over pixels is then a mean over
// the dots, whether or not a whole number of them fits (Hann's window).
std::vector<double> faded_out(int count) {
  std::vector<double> weights;
  for (int i = 0; i < count; ++i) {
    weights.push_back((1.0 - std::cos(2.0 * std::numbers::pi * (i + 0.5) / count)) / count);
  }
  return weights;
}

double tone_of(float value) { return value > 0.0F ? std::min(1.0, double{value}) : 0.0; }

double luminance(const float* rgb) {  // Rec. 709
  return 0.2126 * tone_of(rgb[0]) + 0.7152 * tone_of(rgb[1]) + 0.0722 * tone_of(rgb[2]);
}

// The tones that are shown: of each channel, or one for all.
class Tones {
 public:
  Tones(const Image& color, bool gray)
      : color_(color), gray_(gray && color.channels() == 3), count_(gray_ ? 1 : color.channels()) {}

  int count() const { return count_; }
  double at(int x, int y, int i) const {
    const float* pixel = color_.at(x, y);
    return gray_ ? luminance(pixel) : tone_of(pixel[i]);
  }
  // `value` for tone i in a picture of as many channels as the colour.
  void set(float* pixel, int i, double value) const {
    const auto shown = static_cast<float>(value);
    if (!gray_) {
      pixel[i] = shown;
    } else {
      std::fill_n(pixel, color_.channels(), shown);
    }
  }

 private:
  const Image& color_;
  bool gray_;
  int count_;
};

Image screened(const Tones& tones, const Image& color, const HalftoneSpec& spec) {
  const HalftoneScreen screen(spec);
  const int scale = spec.patterns ? whole_cell(spec.cell) : 1;
  const double steps = spec.levels - 1;
  Image result(color.width() * scale, color.height() * scale, color.channels());
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x) {
      const double threshold = screen.threshold(x, y);
      for (int i = 0; i < tones.count(); ++i) {
        const double tone = tones.at(x / scale, y / scale, i) * steps;
        const double level = std::floor(tone);
        tones.set(result.at(x, y), i, (level + (tone - level > threshold ? 1.0 : 0.0)) / steps);
      }
    }
  }
  return result;
}

Image diffused(const Tones& tones, const Image& color, const HalftoneSpec& spec) {
  const double steps = spec.levels - 1;
  const int width = color.width();
  Image result(width, color.height(), color.channels());
  // With one pixel more on either side: what leaves the picture is lost.
  const auto row = [&] { return std::vector<double>(static_cast<std::size_t>(width) + 2); };
  for (int i = 0; i < tones.count(); ++i) {
    std::vector<double> here = row();
    for (int y = 0; y < color.height(); ++y) {
      std::vector<double> below = row();
      const int ahead = y % 2 == 0 ? 1 : -1;
      for (int k = 0; k < width; ++k) {
        const int x = ahead > 0 ? k : width - 1 - k;
        const auto at = [&](std::vector<double>& errors, int column) -> double& {
          return errors[static_cast<std::size_t>(column + 1)];
        };
        const double wanted = tones.at(x, y, i) + at(here, x);
        const double shown = std::clamp(std::round(wanted * steps), 0.0, steps) / steps;
        tones.set(result.at(x, y), i, shown);
        const double error = (wanted - shown) / 16.0;
        at(here, x + ahead) += 7.0 * error;
        at(below, x - ahead) += 3.0 * error;
        at(below, x) += 5.0 * error;
        at(below, x + ahead) += error;
      }
      here = std::move(below);
    }
  }
  return result;
}

}  // namespace

std::vector<int> clustered_order(int n) {
  require_cell(n);
  if (n == 2) return {0, 2, 3, 1};
  if (n == 3) return {6, 8, 4, 1, 0, 3, 5, 2, 7};
  const std::vector<Place> cell = places(n);
  std::vector<std::size_t> sequence(cell.size());
  std::iota(sequence.begin(), sequence.end(), std::size_t{0});
  std::ranges::sort(sequence, {}, [&](std::size_t i) { return cell[i]; });
  std::vector<int> order(cell.size());
  for (std::size_t rank = 0; rank < sequence.size(); ++rank) {
    order[sequence[rank]] = static_cast<int>(rank);
  }
  return order;
}

std::vector<double> symmetric_order(int n) {
  require_cell(n);
  const std::vector<Place> cell = places(n);
  std::vector<double> order;
  for (const Place& place : cell) {
    const auto nearer = std::ranges::count_if(
        cell, [&](const Place& other) { return other.distance < place.distance; });
    const auto alike = std::ranges::count(cell, place.distance, &Place::distance);
    order.push_back(static_cast<double>(nearer) + 0.5 * static_cast<double>(alike - 1));
  }
  return order;
}

bool has_dispersed_order(int n) noexcept {
  while (n > 3 && n % 2 == 0) n /= 2;
  return n == 2 || n == 3;
}

std::vector<int> dispersed_order(int n) {
  require_cell(n);
  if (!has_dispersed_order(n)) {
    throw Error(ErrorCode::outside_domain,
                "dispersed dots have cells of 2, 3, 4, 6, 8, 12 or 16 pixels a side");
  }
  constexpr std::array<int, 4> kTwo = {0, 2, 3, 1};
  if (n == 2) return {kTwo.begin(), kTwo.end()};
  if (n == 3) return {7, 2, 6, 4, 0, 1, 3, 8, 5};
  const int half = n / 2;
  const std::vector<int> quarter = dispersed_order(half);
  std::vector<int> order;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const int inner = quarter[static_cast<std::size_t>(y % half * half + x % half)];
      order.push_back(4 * inner + kTwo[static_cast<std::size_t>(y / half * 2 + x / half)]);
    }
  }
  return order;
}

HalftoneScreen::HalftoneScreen(const HalftoneSpec& spec) {
  const auto spread = [&](const auto& order) {
    for (const auto rank : order) {
      cell_.push_back((static_cast<double>(rank) + 0.5) / static_cast<double>(order.size()));
    }
  };
  switch (spec.method) {
    case HalftoneMethod::clustered_dot:
      side_ = whole_cell(spec.cell);
      spec.symmetric ? spread(symmetric_order(side_)) : spread(clustered_order(side_));
      return;
    case HalftoneMethod::dispersed_dot:
      side_ = whole_cell(spec.cell);
      spread(dispersed_order(side_));
      return;
    case HalftoneMethod::varying_dot:
      require_cell(spec.cell);
      across_ = std::cos(spec.angle) / spec.cell;
      down_ = std::sin(spec.angle) / spec.cell;
      rank_dots();
      return;
    case HalftoneMethod::error_diffusion:
      throw Error(ErrorCode::outside_domain, "error diffusion has no thresholds");
  }
}

double HalftoneScreen::threshold(int x, int y) const noexcept {
  if (side_ == 0) return threshold_of_dots(x, y);
  return cell_[static_cast<std::size_t>(y % side_ * side_ + x % side_)];
}

double HalftoneScreen::brightness_of_dots(int x, int y) const noexcept {
  const double u = across_ * x + down_ * y + kPhaseAcross;
  const double v = across_ * y - down_ * x + kPhaseDown;
  return std::cos(2.0 * std::numbers::pi * u) + std::cos(2.0 * std::numbers::pi * v);
}

void HalftoneScreen::rank_dots() {
  const std::vector<double> weights = faded_out(kLookedAt);
  std::vector<std::pair<double, double>> pixels;  // brightness, weight
  for (int y = 0; y < kLookedAt; ++y) {
    for (int x = 0; x < kLookedAt; ++x) {
      pixels.emplace_back(brightness_of_dots(x, y), weights[static_cast<std::size_t>(x)] *
                                                        weights[static_cast<std::size_t>(y)]);
    }
  }
  std::ranges::sort(pixels, std::ranges::greater{});
  double brighter = 0.0;
  for (auto first = pixels.begin(); first != pixels.end();) {
    double alike = 0.0;
    auto last = first;
    for (; last != pixels.end() && first->first - last->first < kEquallyBright; ++last) {
      alike += last->second;
    }
    // The darkest of those alike, so that the first brightness not above a pixel's is its own.
    dots_.push_back({.brightness = std::prev(last)->first, .threshold = brighter + 0.5 * alike});
    brighter += alike;
    first = last;
  }
}

double HalftoneScreen::threshold_of_dots(int x, int y) const noexcept {
  const double brightness = brightness_of_dots(x, y) + 0.5 * kEquallyBright;
  const auto dot = std::ranges::lower_bound(dots_, brightness, std::ranges::greater{},
                                            &DotThreshold::brightness);
  return dot == dots_.end() ? dots_.back().threshold : dot->threshold;
}

Image halftone(const Image& color, const HalftoneSpec& spec) {
  if (spec.levels < 2 || spec.levels > kMostLevels) {
    throw Error(ErrorCode::outside_domain,
                "a halftone has 2 to " + std::to_string(kMostLevels) + " levels");
  }
  const bool has_cells =
      spec.method == HalftoneMethod::clustered_dot || spec.method == HalftoneMethod::dispersed_dot;
  if (spec.patterns && !has_cells) {
    throw Error(ErrorCode::outside_domain, "only cells of ordered dither can be patterns");
  }
  const Tones tones(color, spec.gray);
  if (spec.method == HalftoneMethod::error_diffusion) return diffused(tones, color, spec);
  return screened(tones, color, spec);
}

}  // namespace fstop
