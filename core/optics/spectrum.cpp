#include "core/optics/spectrum.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/optics/circular_psf.h"

namespace fstop {
namespace {

constexpr int kFewestIntervals = 4;
constexpr int kFirstIntervals = 16;
constexpr int kMostIntervals = 4096;
using Rgb = std::array<double, 3>;

// exp(-t^2/2), the width's inverse (1/nm) differing to either side of the centre (nm).
double lobe(double nm, double centre, double below, double above) noexcept {
  const double t = (nm - centre) * (nm < centre ? below : above);
  return std::exp(-0.5 * t * t);
}

double gaussian_band(double nm, double centre, double full_width) noexcept {
  constexpr double kWidthOfSigma = 2.3548200450309493;  // 2 sqrt(2 ln 2)
  const double t = (nm - centre) * kWidthOfSigma / full_width;
  return std::exp(-0.5 * t * t);
}

bool visible(Length wavelength) noexcept {
  // The grid's last point may lie an ulp outside.
  return wavelength >= kShortestVisible * (1.0 - 1e-12) &&
         wavelength <= kLongestVisible * (1.0 + 1e-12);
}

Length grid_wavelength(int index, int intervals) noexcept {
  return kShortestVisible +
         (kLongestVisible - kShortestVisible) * (static_cast<double>(index) / intervals);
}

// Half weight at the ends of the range.
double trapezoid(int index, int intervals) noexcept {
  return index == 0 || index == intervals ? 0.5 : 1.0;
}

void require_radii(std::span<const double> radii, double tolerance) {
  if (!(tolerance > 0.0 && tolerance < 1.0)) {
    throw Error(ErrorCode::outside_domain, "the spectral tolerance must lie between 0 and 1");
  }
  const bool valid = !radii.empty() && std::ranges::all_of(radii, [](double r) {
    return r >= 0.0 && std::isfinite(r);
  });
  if (!valid) throw Error(ErrorCode::outside_domain, "needs radii >= 0 m, at least one");
}

// Running sums over wavelengths: weight times density, and weight.
class Accumulator {
 public:
  Accumulator(const CircularPupil& pupil, SpectralBands bands, std::span<const double> radii)
      : pupil_(pupil), bands_(bands), radii_(radii), sums_(radii.size()), single_(radii.size()) {}

  void add(Length wavelength, double share) {
    const CircularPsf psf(pupil_, wavelength);
    model_error_ = std::max(model_error_, psf.error().total());
    psf.densities(radii_, single_);
    const Rgb response = channel_response(bands_, wavelength);
    for (std::size_t c = 0; c < 3; ++c) {
      const double weight = share * response[c];
      weights_[c] += weight;
      for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i][c] += weight * single_[i];
    }
  }

  std::vector<Rgb> mean() const {
    std::vector<Rgb> result = sums_;
    for (Rgb& value : result) {
      for (std::size_t c = 0; c < 3; ++c) value[c] /= weights_[c];
    }
    return result;
  }
  double model_error() const { return model_error_; }

 private:
  const CircularPupil& pupil_;
  SpectralBands bands_;
  std::span<const double> radii_;
  std::vector<Rgb> sums_;
  std::vector<double> single_;
  Rgb weights_ = {};
  double model_error_ = 0.0;
};

// The largest change, as a share of its channel's largest value.
double largest_change(const std::vector<Rgb>& coarse, const std::vector<Rgb>& fine) {
  double worst = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    double change = 0.0;
    double peak = 0.0;
    for (std::size_t i = 0; i < fine.size(); ++i) {
      change = std::max(change, std::abs(fine[i][c] - coarse[i][c]));
      peak = std::max(peak, std::abs(fine[i][c]));
    }
    worst = std::max(worst, change / peak);
  }
  return worst;
}

}  // namespace

std::string_view name_of(SpectralBands bands) noexcept {
  return bands == SpectralBands::sensor ? "sensor" : "cie-1931";
}

std::array<double, 3> colour_matching(Length wavelength) noexcept {
  const double nm = wavelength / 1.0_nm;
  return {0.362 * lobe(nm, 442.0, 0.0624, 0.0374) + 1.056 * lobe(nm, 599.8, 0.0264, 0.0323) -
              0.065 * lobe(nm, 501.1, 0.0490, 0.0382),
          0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322),
          1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725)};
}

std::array<double, 3> channel_response(SpectralBands bands, Length wavelength) noexcept {
  if (!visible(wavelength)) return {};
  const double nm = wavelength / 1.0_nm;
  if (bands == SpectralBands::sensor) {
    return {gaussian_band(nm, 600.0, 80.0), gaussian_band(nm, 540.0, 85.0),
            gaussian_band(nm, 465.0, 60.0)};
  }
  const auto [x, y, z] = colour_matching(wavelength);
  return {3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z,
          0.0557 * x - 0.2040 * y + 1.0570 * z};
}

std::vector<SpectralSample> spectral_samples(SpectralBands bands, int intervals) {
  if (intervals < kFewestIntervals || intervals > kMostIntervals) {
    throw Error(ErrorCode::outside_domain, "the spectrum is divided into 4 to 4096 intervals");
  }
  std::vector<SpectralSample> samples;
  Rgb total = {};
  for (int i = 0; i <= intervals; ++i) {
    SpectralSample sample{.wavelength = grid_wavelength(i, intervals)};
    sample.weight = channel_response(bands, sample.wavelength);
    for (std::size_t c = 0; c < 3; ++c) {
      sample.weight[c] *= trapezoid(i, intervals);
      total[c] += sample.weight[c];
    }
    samples.push_back(sample);
  }
  for (SpectralSample& sample : samples) {
    for (std::size_t c = 0; c < 3; ++c) sample.weight[c] /= total[c];
  }
  return samples;
}

PolychromaticProfile polychromatic_profile(const CircularPupil& pupil, SpectralBands bands,
                                           std::span<const double> radii, double tolerance) {
  require_radii(radii, tolerance);
  Accumulator sum(pupil, bands, radii);
  int intervals = kFirstIntervals;
  for (int i = 0; i <= intervals; ++i) {
    sum.add(grid_wavelength(i, intervals), trapezoid(i, intervals));
  }
  std::vector<Rgb> coarse = sum.mean();
  while (intervals <= kMostIntervals / 2) {
    // The wavelengths between the old ones; all inner weights stay 1.
    intervals *= 2;
    for (int i = 1; i < intervals; i += 2) sum.add(grid_wavelength(i, intervals), 1.0);
    std::vector<Rgb> fine = sum.mean();
    const double change = largest_change(coarse, fine);
    if (change <= tolerance) {
      return {.density = std::move(fine),
              .wavelengths = intervals + 1,
              .spectral_error = change,
              .model_error = sum.model_error()};
    }
    coarse = std::move(fine);
  }
  throw Error(ErrorCode::over_budget,
              "the spectral tolerance needs over 4097 wavelengths at this defocus");
}

}  // namespace fstop
