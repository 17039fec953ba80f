#include "server/progress.h"

#include <algorithm>
#include <utility>

namespace fstop::server {
namespace {

constexpr int kSamplesASide = 4;

// The mean of `picture` over one cell, whose first pixel is (x0, y0) and whose end (x1, y1).
void average(const Image& picture, int x0, int y0, int x1, int y1, float* mean) {
  const int step_x = std::max(1, (x1 - x0) / kSamplesASide);
  const int step_y = std::max(1, (y1 - y0) / kSamplesASide);
  const int channels = picture.channels();
  float count = 0.0F;
  std::fill_n(mean, channels, 0.0F);
  for (int y = y0; y < y1; y += step_y) {
    for (int x = x0; x < x1; x += step_x) {
      const float* pixel = picture.at(x, y);
      for (int c = 0; c < channels; ++c) mean[c] += pixel[c];
      count += 1.0F;
    }
  }
  for (int c = 0; c < channels; ++c) mean[c] /= count;
}

}  // namespace

Image thumbnail(const Image& picture, int side) {
  const int longer = std::max(picture.width(), picture.height());
  if (longer <= side) return picture;
  const auto scaled = [&](int length) {
    return std::max(1, static_cast<int>(static_cast<long long>(length) * side / longer));
  };
  Image small(scaled(picture.width()), scaled(picture.height()), picture.channels());
  const auto edge = [](int i, int length, int cells) {
    return static_cast<int>(static_cast<long long>(i) * length / cells);
  };
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      average(picture, edge(x, picture.width(), small.width()),
              edge(y, picture.height(), small.height()),
              edge(x + 1, picture.width(), small.width()),
              edge(y + 1, picture.height(), small.height()), small.at(x, y));
    }
  }
  return small;
}

void Progress::begin() {
  const std::lock_guard lock(mutex_);
  state_.started = std::chrono::steady_clock::now();
  ++state_.version;
}

void Progress::advance(double fraction) {
  const std::lock_guard lock(mutex_);
  if (!(fraction > state_.fraction)) return;
  state_.fraction = std::min(fraction, 1.0);
  ++state_.version;
}

void Progress::changed() {
  const std::lock_guard lock(mutex_);
  ++state_.version;
}

void Progress::show(const Image& picture, double upper_95) {
  const auto now = std::chrono::steady_clock::now();
  if (shown_ != Time{} && now - shown_ < kBetweenPreviews) return;
  shown_ = now;
  keep(thumbnail(picture, kPreviewSide), upper_95);
}

void Progress::keep(Image preview, double upper_95) {
  auto shared = std::make_shared<const Image>(std::move(preview));
  const std::lock_guard lock(mutex_);
  state_.preview = std::move(shared);
  state_.upper_95 = upper_95;
  state_.shown = std::chrono::steady_clock::now();
  ++state_.previews;
  ++state_.version;
}

Progress::State Progress::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

}  // namespace fstop::server
