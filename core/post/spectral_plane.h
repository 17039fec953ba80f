#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "core/film/image.h"

namespace fstop {

/// A real plane and, in the same memory, its discrete Fourier transform. Both sides are even.
/// The spectrum of a real plane is Hermitian: it is kept in as many numbers as the plane had, in
/// OpenCV's packed order, which stays in here.
class SpectralPlane {
 public:
  /// All zero. Throws: Error{internal} unless width and height are even and at least 2.
  SpectralPlane(int width, int height);

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  ImageView<float> view() noexcept { return {values_.data(), width_, height_, 1, width_}; }
  ImageView<const float> view() const noexcept {
    return {values_.data(), width_, height_, 1, width_};
  }
  void clear() noexcept;

  /// From the plane to its spectrum, unscaled, and back, divided by width * height.
  void transform();
  void invert();

  /// Adds `source`'s spectrum times a real, point-symmetric multiplier: `row(y, g)` fills g[x] for
  /// the frequencies x = 0 to width/2 (cycles per width) of row frequency y, from -height/2 + 1 to
  /// height/2 (cycles per height, down). Both planes hold spectra of one size.
  template <typename RowOfMultiplier>
  void add_product(const SpectralPlane& source, RowOfMultiplier&& row);
  /// The same with a Hermitian multiplier, std::complex<float> in g.
  template <typename RowOfMultiplier>
  void add_complex_product(const SpectralPlane& source, RowOfMultiplier&& row);

  SpectralPlane& operator+=(const SpectralPlane& other) noexcept;
  /// The product of two spectra: of their planes' circular convolution.
  SpectralPlane& operator*=(const SpectralPlane& other);

 private:
  int row_frequency(int r) const noexcept { return r <= height_ / 2 ? r : r - height_; }
  float* line(int r) noexcept { return values_.data() + std::ptrdiff_t{r} * width_; }
  const float* line(int r) const noexcept { return values_.data() + std::ptrdiff_t{r} * width_; }
  // Adds to the first and the last column, which are packed downwards: rows 2j - 1 and 2j hold the
  // real and imaginary part of row frequency j.
  void add_edge_columns(const SpectralPlane& source, const std::vector<std::complex<float>>& first,
                        const std::vector<std::complex<float>>& last) noexcept;

  int width_;
  int height_;
  std::vector<float> values_;
};

/// The smallest even length >= n without prime factors above 5: what transforms are fastest for.
int fast_transform_length(int n);

template <typename RowOfMultiplier>
void SpectralPlane::add_product(const SpectralPlane& source, RowOfMultiplier&& row) {
  const int half = width_ / 2;
  std::vector<float> g(static_cast<std::size_t>(half) + 1);
  std::vector<std::complex<float>> first(static_cast<std::size_t>(height_) / 2 + 1);
  std::vector<std::complex<float>> last(first.size());
  for (int r = 0; r < height_; ++r) {
    row(row_frequency(r), std::span<float>(g));
    float* out = line(r);
    const float* in = source.line(r);
    for (int x = 1; x < half; ++x) {
      const float factor = g[static_cast<std::size_t>(x)];
      out[2 * x - 1] += factor * in[2 * x - 1];
      out[2 * x] += factor * in[2 * x];
    }
    if (r <= height_ / 2) {
      first[static_cast<std::size_t>(r)] = g.front();
      last[static_cast<std::size_t>(r)] = g.back();
    }
  }
  add_edge_columns(source, first, last);
}

template <typename RowOfMultiplier>
void SpectralPlane::add_complex_product(const SpectralPlane& source, RowOfMultiplier&& row) {
  const int half = width_ / 2;
  std::vector<std::complex<float>> g(static_cast<std::size_t>(half) + 1);
  std::vector<std::complex<float>> first(static_cast<std::size_t>(height_) / 2 + 1);
  std::vector<std::complex<float>> last(first.size());
  for (int r = 0; r < height_; ++r) {
    row(row_frequency(r), std::span<std::complex<float>>(g));
    float* out = line(r);
    const float* in = source.line(r);
    for (int x = 1; x < half; ++x) {
      const std::complex<float> factor = g[static_cast<std::size_t>(x)];
      const float re = in[2 * x - 1];
      const float im = in[2 * x];
      out[2 * x - 1] += factor.real() * re - factor.imag() * im;
      out[2 * x] += factor.real() * im + factor.imag() * re;
    }
    if (r <= height_ / 2) {
      first[static_cast<std::size_t>(r)] = g.front();
      last[static_cast<std::size_t>(r)] = g.back();
    }
  }
  add_edge_columns(source, first, last);
}

}  // namespace fstop
