#include "core/study/image_baseline.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/study/student_t.h"

namespace fstop {
namespace {

constexpr int kChannels = 3;
constexpr double kRounding = 0x1p-20;       // of a value
constexpr double kSmallestValue = 0x1p-10;  // of which roundings are still counted

struct Block {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  int pixels() const { return width * height; }
};

std::vector<Block> blocks_of(const Image& image) {
  std::vector<Block> blocks;
  for (int y = 0; y < image.height(); y += kBaselineBlock) {
    for (int x = 0; x < image.width(); x += kBaselineBlock) {
      blocks.push_back({x, y, std::min(kBaselineBlock, image.width() - x),
                        std::min(kBaselineBlock, image.height() - y)});
    }
  }
  return blocks;
}

double mean_of(const Image& image, const Block& block, int channel) {
  double sum = 0.0;
  for (int y = block.y; y < block.y + block.height; ++y) {
    for (int x = block.x; x < block.x + block.width; ++x) sum += image.at(x, y)[channel];
  }
  return sum / block.pixels();
}

double total_of(const Image& image, int channel) {
  return mean_of(image, {0, 0, image.width(), image.height()}, channel);
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

// Of a sample, from the first value on: no digits are lost to a large mean.
Moments moments_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v - values.front();
  const double mean = sum / n;
  for (const double v : values) squares += std::pow(v - values.front() - mean, 2);
  return {.mean = values.front() + mean, .variance = squares / (n - 1.0)};
}

// A grey picture's channels are one test, not three. A picture that is no longer grey is tested in
// all of them.
bool is_copy_of_red(const Image& picture, const ImageBaseline& baseline, int channel) {
  const auto same = [channel](const Image& image) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        if (image.at(x, y)[channel] != image.at(x, y)[0]) return false;
      }
    }
    return true;
  };
  return channel > 0 && same(baseline.mean) && same(baseline.variance) && same(picture);
}

double rounding_variance(double mean) {
  const double size = kRounding * std::max(std::abs(mean), kSmallestValue);
  return size * size;
}

// One test: how far `value` is from `mean`, and whether chance has a part in it.
struct Deviation {
  double t = 0.0;
  bool has_noise = false;
};

Deviation deviation(double value, double mean, double variance, int replicates) {
  const double floor = rounding_variance(mean);
  const double scale = std::max(variance, floor) * (1.0 + 1.0 / replicates);
  return {.t = (value - mean) / std::sqrt(scale), .has_noise = variance > floor};
}

/// Gathers the tests of one level.
class LevelTests {
 public:
  explicit LevelTests(std::string name) { level_.name = std::move(name); }

  void add(const Deviation& test, int x, int y, int channel) {
    level_.tests += test.has_noise ? 1 : 0;
    const double size = std::abs(test.t);
    sizes_.push_back(size);
    if (size <= level_.largest) return;
    level_.largest = size;
    level_.x = x;
    level_.y = y;
    level_.channel = channel;
  }

  BaselineLevel finish(double alarm_rate, int replicates) && {
    level_.alarm_rate = alarm_rate;
    // 1 - (1 - a)^(1/k), with all digits of small a.
    const double each = -std::expm1(std::log1p(-alarm_rate) / std::max(1, level_.tests));
    level_.threshold = student_t_threshold(each, replicates - 1.0);
    level_.alarms = static_cast<int>(
        std::ranges::count_if(sizes_, [&](double size) { return size > level_.threshold; }));
    return std::move(level_);
  }

 private:
  BaselineLevel level_ = {};
  std::vector<double> sizes_ = {};
};

void require_like(const Image& picture, const Image& other) {
  if (picture.width() != other.width() || picture.height() != other.height() ||
      picture.channels() != kChannels || other.channels() != kChannels) {
    throw Error(ErrorCode::outside_domain,
                "the picture is " + std::to_string(picture.width()) + " x " +
                    std::to_string(picture.height()) + " pixels, the baseline " +
                    std::to_string(other.width()) + " x " + std::to_string(other.height()));
  }
}

// The largest variance of a pixel in the block and those around it: what each pixel's own is at
// least.
double largest_variance(const ImageBaseline& baseline, const Block& block, int channel) {
  const Image& variance = baseline.variance;
  const int right = std::min(block.x + 2 * kBaselineBlock, variance.width());
  const int bottom = std::min(block.y + 2 * kBaselineBlock, variance.height());
  float largest = 0.0F;
  for (int y = std::max(0, block.y - kBaselineBlock); y < bottom; ++y) {
    for (int x = std::max(0, block.x - kBaselineBlock); x < right; ++x)
      largest = std::max(largest, variance.at(x, y)[channel]);
  }
  return double{largest};
}

}  // namespace

void BaselineBuilder::add(const Image& picture) {
  require_like(picture, pictures_.empty() ? picture : pictures_.front());
  if (!std::ranges::all_of(picture.pixels(), [](float v) { return std::isfinite(v); }))
    throw Error(ErrorCode::outside_domain, "a baseline's pictures must hold finite values");
  pictures_.push_back(picture);
}

ImageBaseline BaselineBuilder::finish() const {
  if (replicates() < 2)
    throw Error(ErrorCode::outside_domain, "a baseline needs 2 replicates or more");
  const Image& first = pictures_.front();
  ImageBaseline baseline{.replicates = replicates(),
                         .mean = Image(first.width(), first.height(), kChannels),
                         .variance = Image(first.width(), first.height(), kChannels),
                         .block_variance = Image(first.width(), first.height(), kChannels)};
  std::vector<double> values(pictures_.size());
  for (std::size_t i = 0; i < first.pixels().size(); ++i) {
    for (std::size_t k = 0; k < pictures_.size(); ++k) values[k] = pictures_[k].pixels()[i];
    const Moments moments = moments_of(values);
    baseline.mean.pixels()[i] = static_cast<float>(moments.mean);
    baseline.variance.pixels()[i] = static_cast<float>(moments.variance);
  }
  for (int c = 0; c < kChannels; ++c) {
    for (const Block& block : blocks_of(first)) {
      for (std::size_t k = 0; k < pictures_.size(); ++k)
        values[k] = mean_of(pictures_[k], block, c);
      const auto variance = static_cast<float>(moments_of(values).variance);
      for (int y = block.y; y < block.y + block.height; ++y) {
        for (int x = block.x; x < block.x + block.width; ++x) {
          baseline.block_variance.at(x, y)[c] = variance;
        }
      }
    }
    for (std::size_t k = 0; k < pictures_.size(); ++k) values[k] = total_of(pictures_[k], c);
    const Moments total = moments_of(values);
    baseline.total[static_cast<std::size_t>(c)] = total.mean;
    baseline.total_variance[static_cast<std::size_t>(c)] = total.variance;
  }
  return baseline;
}

bool BaselineVerdict::differs() const {
  return std::ranges::any_of(levels, [](const BaselineLevel& level) { return level.alarms > 0; });
}

BaselineVerdict compared(const Image& picture, const ImageBaseline& baseline, double alarm_rate) {
  require_like(picture, baseline.mean);
  if (!(alarm_rate > 0.0 && alarm_rate < 1.0))
    throw Error(ErrorCode::outside_domain, "the alarm rate must lie between 0 and 1");
  const int n = baseline.replicates;
  LevelTests pixels("pixel"), blocks("block"), whole("picture");
  BaselineVerdict verdict;
  double squares = 0.0, variances = 0.0;
  for (int c = 0; c < kChannels; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const double total = total_of(picture, c);
    verdict.brightness[k] = baseline.total[k] != 0.0 ? total / baseline.total[k] : 1.0;
    if (is_copy_of_red(picture, baseline, c)) continue;
    for (const Block& block : blocks_of(picture)) {
      const double least = largest_variance(baseline, block, c);
      for (int y = block.y; y < block.y + block.height; ++y) {
        for (int x = block.x; x < block.x + block.width; ++x) {
          const double variance = std::max<double>(baseline.variance.at(x, y)[c], least);
          pixels.add(deviation(picture.at(x, y)[c], baseline.mean.at(x, y)[c], variance, n), x, y,
                     c);
        }
      }
      blocks.add(deviation(mean_of(picture, block, c), mean_of(baseline.mean, block, c),
                           baseline.block_variance.at(block.x, block.y)[c], n),
                 block.x, block.y, c);
    }
    whole.add(deviation(total, baseline.total[k], baseline.total_variance[k], n), 0, 0, c);
  }
  for (std::size_t i = 0; i < picture.pixels().size(); ++i) {
    squares += std::pow(picture.pixels()[i] - baseline.mean.pixels()[i], 2);
    variances += baseline.variance.pixels()[i] * (1.0 + 1.0 / n);
  }
  const auto count = static_cast<double>(picture.pixels().size());
  verdict.rmse = std::sqrt(squares / count);
  verdict.expected_rmse = std::sqrt(variances / count);
  const double each = -std::expm1(std::log1p(-alarm_rate) / 3.0);
  verdict.levels = {std::move(pixels).finish(each, n), std::move(blocks).finish(each, n),
                    std::move(whole).finish(each, n)};
  return verdict;
}

Image deviation_image(const Image& picture, const ImageBaseline& baseline) {
  require_like(picture, baseline.mean);
  Image image(picture.width(), picture.height(), kChannels);
  for (int c = 0; c < kChannels; ++c) {
    for (const Block& block : blocks_of(picture)) {
      const double least = largest_variance(baseline, block, c);
      for (int y = block.y; y < block.y + block.height; ++y) {
        for (int x = block.x; x < block.x + block.width; ++x) {
          const double variance = std::max<double>(baseline.variance.at(x, y)[c], least);
          image.at(x, y)[c] =
              static_cast<float>(deviation(picture.at(x, y)[c], baseline.mean.at(x, y)[c], variance,
                                           baseline.replicates)
                                     .t);
        }
      }
    }
  }
  return image;
}

}  // namespace fstop
