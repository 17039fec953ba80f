#pragma once

#include <cstddef>
#include <vector>

namespace fstop {

/// A window onto pixels somebody else owns: row-major, y down, channels interleaved.
template <typename T>
struct ImageView {
  T* pixels = nullptr;
  int width = 0;
  int height = 0;
  int channels = 0;
  std::ptrdiff_t row_stride = 0;  // in elements

  T* at(int x, int y) const {
    return pixels + y * row_stride + static_cast<std::ptrdiff_t>(x) * channels;
  }
};

/// Pixels in memory: 32-bit float, scene-linear Rec. 709 unless said; row-major, y down.
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels)
      : width_(width),
        height_(height),
        channels_(channels),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                static_cast<std::size_t>(channels)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return pixels_.empty(); }
  std::vector<float>& pixels() { return pixels_; }
  const std::vector<float>& pixels() const { return pixels_; }

  float* at(int x, int y) { return view().at(x, y); }
  const float* at(int x, int y) const { return view().at(x, y); }
  ImageView<float> view() {
    return {pixels_.data(), width_, height_, channels_, std::ptrdiff_t{width_} * channels_};
  }
  ImageView<const float> view() const {
    return {pixels_.data(), width_, height_, channels_, std::ptrdiff_t{width_} * channels_};
  }
  friend bool operator==(const Image&, const Image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  int channels_ = 0;
  std::vector<float> pixels_;
};

}  // namespace fstop
