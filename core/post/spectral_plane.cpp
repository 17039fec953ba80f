#include "core/post/spectral_plane.h"

#include <algorithm>

#include <opencv2/core.hpp>

#include "core/error.h"

namespace fstop {

SpectralPlane::SpectralPlane(int width, int height)
    : width_(width),
      height_(height),
      values_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
  if (width < 2 || height < 2 || width % 2 != 0 || height % 2 != 0) {
    throw Error(ErrorCode::internal, "a spectral plane needs even sides of at least 2");
  }
}

void SpectralPlane::clear() noexcept { std::ranges::fill(values_, 0.0F); }

void SpectralPlane::transform() {
  cv::Mat plane(height_, width_, CV_32F, values_.data());
  cv::dft(plane, plane);
}

void SpectralPlane::invert() {
  cv::Mat plane(height_, width_, CV_32F, values_.data());
  cv::idft(plane, plane, cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
}

SpectralPlane& SpectralPlane::operator+=(const SpectralPlane& other) noexcept {
  for (std::size_t i = 0; i < values_.size(); ++i) values_[i] += other.values_[i];
  return *this;
}

SpectralPlane& SpectralPlane::operator*=(const SpectralPlane& other) {
  cv::Mat plane(height_, width_, CV_32F, values_.data());
  // OpenCV takes no const data; the second factor is only read.
  const cv::Mat factor(height_, width_, CV_32F, const_cast<float*>(other.values_.data()));
  cv::mulSpectrums(plane, factor, plane, 0);
  return *this;
}

void SpectralPlane::add_edge_columns(const SpectralPlane& source,
                                     const std::vector<std::complex<float>>& first,
                                     const std::vector<std::complex<float>>& last) noexcept {
  const int half = height_ / 2;
  const auto add = [&](int column, const std::vector<std::complex<float>>& g) {
    line(0)[column] += g.front().real() * source.line(0)[column];
    line(height_ - 1)[column] += g.back().real() * source.line(height_ - 1)[column];
    for (int j = 1; j < half; ++j) {
      const std::complex<float> factor = g[static_cast<std::size_t>(j)];
      const float re = source.line(2 * j - 1)[column];
      const float im = source.line(2 * j)[column];
      line(2 * j - 1)[column] += factor.real() * re - factor.imag() * im;
      line(2 * j)[column] += factor.real() * im + factor.imag() * re;
    }
  };
  add(0, first);
  add(width_ - 1, last);
}

int fast_transform_length(int n) {
  const int length = cv::getOptimalDFTSize((std::max(n, 2) + 1) / 2);
  return 2 * length;
}

}  // namespace fstop
