// Time of a real two-dimensional transform in single precision, there and back, by OpenCV and by
// the libraries it was chosen before, where this program is built with them (FSTOP_FFT_CANDIDATES).
// One thread; the median and minimum of nine, in processor time.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

#ifdef FSTOP_FFT_CANDIDATES
#include <fftw3.h>

#include <kissfft/kiss_fftr.h>
#endif

#include "tests/bench/thread_timer.h"

namespace fstop {
namespace {

constexpr int kRuns = 9;

struct Size {
  int width = 0;
  int height = 0;
  std::size_t count() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

std::vector<float> noise(const Size& size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  std::vector<float> values(size.count());
  for (float& value : values) value = uniform(random);
  return values;
}

void report(const char* library, const Size& size, const std::function<void()>& there_and_back,
            const std::function<float()>& error) {
  there_and_back();  // touches the memory, makes tables
  const Timing time = seconds_of(there_and_back, kRuns);
  std::printf("%-16s %4d x %4d  %8.2f ms (least %8.2f)  %6.2f ns a pixel  error %.1e\n", library,
              size.width, size.height, time.median * 1e3, time.minimum * 1e3,
              time.median * 1e9 / static_cast<double>(size.count()), static_cast<double>(error()));
}

void bench_opencv(const Size& size) {
  std::vector<float> values = noise(size);
  const cv::Mat image(size.height, size.width, CV_32F, values.data());
  cv::Mat spectrum;
  cv::Mat back;
  report(
      "OpenCV", size,
      [&] {
        cv::dft(image, spectrum);
        cv::dft(spectrum, back, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
      },
      [&] { return static_cast<float>(cv::norm(image, back, cv::NORM_INF)); });
}

#ifdef FSTOP_FFT_CANDIDATES

float largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  float largest = 0.0F;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

void bench_fftw(const char* name, unsigned effort, const Size& size) {
  const std::vector<float> values = noise(size);
  std::vector<float> image(size.count());
  std::vector<float> back(size.count());
  const std::size_t half = static_cast<std::size_t>(size.width) / 2 + 1;
  auto* spectrum = reinterpret_cast<fftwf_complex*>(
      fftwf_malloc(sizeof(fftwf_complex) * half * static_cast<std::size_t>(size.height)));
  const double start = thread_seconds();
  const fftwf_plan there =
      fftwf_plan_dft_r2c_2d(size.height, size.width, image.data(), spectrum, effort);
  const fftwf_plan again =
      fftwf_plan_dft_c2r_2d(size.height, size.width, spectrum, back.data(), effort);
  const double planning = thread_seconds() - start;
  image = values;
  const float scale = 1.0F / static_cast<float>(size.count());
  report(
      name, size,
      [&] {
        fftwf_execute(there);
        fftwf_execute(again);
        for (float& value : back) value *= scale;
      },
      [&] { return largest_difference(values, back); });
  std::printf("%-16s planned in %.2f s\n", "", planning);
  fftwf_destroy_plan(there);
  fftwf_destroy_plan(again);
  fftwf_free(spectrum);
}

// Rows, then columns: the library's own two-dimensional real transform (131.1.0) crashes.
class KissTransform {
 public:
  explicit KissTransform(const Size& size)
      : width_(static_cast<std::size_t>(size.width)),
        height_(static_cast<std::size_t>(size.height)),
        rows_(half() * height_),
        columns_(half() * height_),
        column_(height_),
        row_there_(kiss_fftr_alloc(size.width, 0, nullptr, nullptr)),
        row_again_(kiss_fftr_alloc(size.width, 1, nullptr, nullptr)),
        column_there_(kiss_fft_alloc(size.height, 0, nullptr, nullptr)),
        column_again_(kiss_fft_alloc(size.height, 1, nullptr, nullptr)) {}
  ~KissTransform() {
    kiss_fftr_free(row_there_);
    kiss_fftr_free(row_again_);
    kiss_fft_free(column_there_);
    kiss_fft_free(column_again_);
  }
  KissTransform(const KissTransform&) = delete;
  KissTransform& operator=(const KissTransform&) = delete;

  void there(const std::vector<float>& image) {
    for (std::size_t y = 0; y < height_; ++y) {
      kiss_fftr(row_there_, &image[y * width_], &rows_[y * half()]);
    }
    for (std::size_t k = 0; k < half(); ++k) {
      kiss_fft_stride(column_there_, &rows_[k], &columns_[k * height_], static_cast<int>(half()));
    }
  }
  void again(std::vector<float>& image) {
    const float scale = 1.0F / static_cast<float>(width_ * height_);
    for (std::size_t k = 0; k < half(); ++k) {
      kiss_fft(column_again_, &columns_[k * height_], column_.data());
      for (std::size_t y = 0; y < height_; ++y) {
        rows_[y * half() + k] = {scale * column_[y].r, scale * column_[y].i};
      }
    }
    for (std::size_t y = 0; y < height_; ++y) {
      kiss_fftri(row_again_, &rows_[y * half()], &image[y * width_]);
    }
  }

 private:
  std::size_t half() const { return width_ / 2 + 1; }

  std::size_t width_;
  std::size_t height_;
  std::vector<kiss_fft_cpx> rows_;     // [row][frequency]
  std::vector<kiss_fft_cpx> columns_;  // [frequency][row]
  std::vector<kiss_fft_cpx> column_;
  kiss_fftr_cfg row_there_;
  kiss_fftr_cfg row_again_;
  kiss_fft_cfg column_there_;
  kiss_fft_cfg column_again_;
};

void bench_kissfft(const Size& size) {
  const std::vector<float> values = noise(size);
  std::vector<float> back(size.count());
  KissTransform transform(size);
  report(
      "KissFFT", size,
      [&] {
        transform.there(values);
        transform.again(back);
      },
      [&] { return largest_difference(values, back); });
}

#endif

}  // namespace
}  // namespace fstop

int main() {
  using namespace fstop;
  cv::setNumThreads(1);
  for (const Size& size :
       {Size{1024, 1024}, Size{1440, 1080}, Size{2048, 1536}, Size{2592, 1800}, Size{3072, 2048}}) {
    bench_opencv(size);
#ifdef FSTOP_FFT_CANDIDATES
    bench_fftw("FFTW, estimated", FFTW_ESTIMATE, size);
    bench_fftw("FFTW, measured", FFTW_MEASURE, size);
    bench_kissfft(size);
#endif
  }
  return 0;
}
