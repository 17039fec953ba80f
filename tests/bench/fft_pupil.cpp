#include "tests/bench/fft_pupil.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include <opencv2/core.hpp>

namespace fstop {
namespace {

constexpr int kPadding = 4;

struct SampledField {
  cv::Mat values = {};  // two channels of float, zero frequency at (0, 0)
  double points_inside = 0.0;
};

SampledField pupil_transform(int samples, double defocus) {
  SampledField field;
  field.values = cv::Mat::zeros(kPadding * samples, kPadding * samples, CV_32FC2);
  const double step = 2.0 / samples;
  for (int row = 0; row < samples; ++row) {
    const double y = (row + 0.5) * step - 1.0;
    auto* line = field.values.ptr<cv::Vec2f>(row);
    for (int column = 0; column < samples; ++column) {
      const double x = (column + 0.5) * step - 1.0;
      const double square = x * x + y * y;
      if (square > 1.0) continue;
      const double phase = 0.5 * defocus * square;
      line[column] = {static_cast<float>(std::cos(phase)), static_cast<float>(std::sin(phase))};
      field.points_inside += 1.0;
    }
  }
  cv::dft(field.values, field.values, 0, samples);
  return field;
}

// The multiple of a step that lies nearest.
int nearest_index(double value, double step) { return static_cast<int>(std::lround(value / step)); }

constexpr double kStepOfV = std::numbers::pi / kPadding;

}  // namespace

double FftPupil::nearest_v(double v) const noexcept {
  return nearest_index(v, kStepOfV) * kStepOfV;
}

double FftPupil::nearest_s(double s) const noexcept {
  return nearest_index(s, 2.0 / samples_) * (2.0 / samples_);
}

void FftPupil::intensities(double defocus, std::span<const double> v,
                           std::span<double> result) const {
  const SampledField field = pupil_transform(samples_, defocus);
  const auto* axis = field.values.ptr<cv::Vec2f>(0);
  // The mean over the pupil is 2 G.
  const double scale = 0.25 / (field.points_inside * field.points_inside);
  for (std::size_t i = 0; i < v.size(); ++i) {
    const int index = nearest_index(v[i], kStepOfV);
    if (2 * index > field.values.cols) {
      result[i] = 0.0;
      continue;
    }
    const double real = axis[index][0];
    const double imaginary = axis[index][1];
    result[i] = scale * (real * real + imaginary * imaginary);
  }
}

void FftPupil::otf(double defocus, std::span<const double> s, std::span<double> result) const {
  SampledField field = pupil_transform(samples_, defocus);
  cv::mulSpectrums(field.values, field.values, field.values, 0, true);
  cv::dft(field.values, field.values, cv::DFT_INVERSE);
  const auto* axis = field.values.ptr<cv::Vec2f>(0);
  const double scale = 1.0 / static_cast<double>(axis[0][0]);
  for (std::size_t i = 0; i < s.size(); ++i) {
    const int index = nearest_index(s[i], 2.0 / samples_);
    result[i] = index < samples_ ? scale * static_cast<double>(axis[index][0]) : 0.0;
  }
}

}  // namespace fstop
