#include "core/post/point_spread_image.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/optics/quadrature.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTableStep = 0.1;  // of v; the profile's band ends at 2 radians a unit
constexpr double kQuadratureError = 1e-7;
constexpr int kMostNodes = 200;
constexpr int kTooManyNodes = 1'000'000;
constexpr double kRings = 30.0;  // Airy radii of margin between neighbouring periods
constexpr double kMostFrequencies = 4096.0;
constexpr double kMostRadii = 2'097'152.0;  // 64 MiB of table; pi in v is a fringe

void require(const PointSpreadRaster& raster) {
  const bool valid =
      raster.width > 0 && raster.height > 0 && raster.pitch > Length{} && is_finite(raster.pitch);
  if (!valid) throw Error(ErrorCode::outside_domain, "needs pixels, and a finite pitch above 0");
}

// Gauss-Legendre nodes a side that average a pixel: the profile's phase over half a pixel is w,
// and the rule's error about (w/2)^2k/(2k)!.
int nodes_a_side(double w) {
  double term = 1.0;
  for (int k = 1; k <= kMostNodes; ++k) {
    term *= 0.25 * w * w / ((2.0 * k) * (2.0 * k - 1.0));
    if (term < kQuadratureError) return std::max(k, 2);
  }
  return kTooManyNodes;
}

double pixel_phase(const PointSpread& spread, const PointSpreadRaster& raster) {
  return kPi * spread.cut_off() * raster.pitch.si();
}

double table_step(const PointSpread& spread) { return kTableStep / (kPi * spread.cut_off()); }

double half_diagonal(const PointSpreadRaster& raster) {
  return 0.5 * raster.pitch.si() * std::hypot(raster.width, raster.height);
}

// A round profile between equidistant radii: Lagrange's formula on six points.
class Profile {
 public:
  Profile(const PointSpread& spread, double largest, const RunControl& run)
      : step_(table_step(spread)) {
    std::vector<double> radii;
    if (!(largest / step_ <= kMostRadii)) {
      throw Error(ErrorCode::over_budget,
                  "the image of a point has too many fringes in this window: over 66000");
    }
    const auto count = static_cast<std::size_t>(largest / step_) + 2 * kMargin;
    for (std::size_t i = 0; i < count; ++i) radii.push_back(static_cast<double>(i) * step_);
    values_.resize(radii.size() + kMargin);
    const std::span<Channels> positive = std::span(values_).subspan(kMargin);
    const auto chunks = static_cast<int>((radii.size() + kChunk - 1) / kChunk);
    parallel_for(run, chunks, [&](int chunk) {
      const std::size_t first = static_cast<std::size_t>(chunk) * kChunk;
      const std::size_t size = std::min(kChunk, radii.size() - first);
      spread.densities(std::span(radii).subspan(first, size), positive.subspan(first, size));
    });
    for (std::size_t i = 0; i < kMargin; ++i) values_[i] = positive[kMargin - i];  // even
  }

  void add(double radius, double weight, Channels& sum) const noexcept {
    const double place = radius / step_;
    const auto index = static_cast<std::size_t>(place);
    const double t = place - static_cast<double>(index);
    const double a = t + 2.0, b = t + 1.0, d = t - 1.0, e = t - 2.0, f = t - 3.0;
    const double factors[] = {-b * t * d * e * f / 120.0, a * t * d * e * f / 24.0,
                              -a * b * d * e * f / 12.0,  a * b * t * e * f / 12.0,
                              -a * b * t * d * f / 24.0,  a * b * t * d * e / 120.0};
    const Channels* first = &values_[index + kMargin - 2];
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * factors[i] * first[i][c];
    }
  }

 private:
  static constexpr std::size_t kMargin = 3;
  static constexpr std::size_t kChunk = 512;
  double step_;
  std::vector<Channels> values_ = {};  // [i] at (i - kMargin) steps
};

void put(Image& image, int x, int y, const Channels& value) {
  for (int c = 0; c < image.channels(); ++c) {
    image.at(x, y)[c] = static_cast<float>(value[static_cast<std::size_t>(c)]);
  }
}

// One quarter, and its mirror images.
void fill_round(const PointSpread& spread, const PointSpreadRaster& raster, Image& image,
                const RunControl& run) {
  const int nodes = nodes_a_side(pixel_phase(spread, raster));
  if (nodes == kTooManyNodes) {
    throw Error(ErrorCode::over_budget,
                "the pixels are too coarse for this image of a point: over 100 fringes in each");
  }
  const QuadratureRule rule = gauss_legendre(nodes);
  const double pitch = raster.pitch.si();
  const Profile profile(spread, half_diagonal(raster), run);
  parallel_for(run, (raster.height + 1) / 2, [&](int row) {
    for (int column = 0; column < (raster.width + 1) / 2; ++column) {
      Channels mean = {};
      for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
        const double y = (row + 0.5 * (1.0 + rule.nodes[i]) - 0.5 * raster.height) * pitch;
        for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
          const double x = (column + 0.5 * (1.0 + rule.nodes[j]) - 0.5 * raster.width) * pitch;
          profile.add(std::hypot(x, y), 0.25 * rule.weights[i] * rule.weights[j], mean);
        }
      }
      for (const int x : {column, raster.width - 1 - column}) {
        for (const int y : {row, raster.height - 1 - row}) put(image, x, y, mean);
      }
    }
  });
}

// The Fourier series of an image of period `period`: frequencies j/period, |j| <= most.
struct Series {
  double period = 0.0;
  double most = 0.0;  // a whole number
};

Series series_of(const PointSpread& spread, const PointSpreadRaster& raster) {
  const double extent = std::max(raster.width, raster.height) * raster.pitch.si();
  // Corners of blades reach farther than the disc of their area, a triangle's 1.56 times.
  const double reach =
      1.6 * geometric_radius(spread.spec()).si() + kRings * airy_radius(spread.spec()).si();
  Series series{.period = std::max(4.0 * extent, 0.5 * extent + reach)};
  series.most = std::floor(spread.cut_off() * series.period);
  return series;
}

// j as a loop counts it.
int frequency_count(const Series& series) {
  if (series.most <= kMostFrequencies) return static_cast<int>(series.most);
  throw Error(ErrorCode::over_budget,
              "the image of a point has too many fringes in this window: over 4096 to a side");
}

double sinc(double x) { return x == 0.0 ? 1.0 : std::sin(x) / x; }

// exp(2 pi i j x/period) at every pixel's middle, [j * count + pixel], j from `first` to `last`.
std::vector<std::complex<double>> waves(const Series& series, int first, int last, int count,
                                        double pitch) {
  std::vector<std::complex<double>> table;
  for (int j = first; j <= last; ++j) {
    for (int i = 0; i < count; ++i) {
      const double x = (i + 0.5 - 0.5 * count) * pitch;
      table.push_back(std::polar(1.0, 2.0 * kPi * j / series.period * x));
    }
  }
  return table;
}

// Sums rows of frequencies over j, columns over k: H is Hermitian, so that j >= 0 suffices.
class SeriesImage {
 public:
  SeriesImage(const PointSpread& spread, const PointSpreadRaster& raster)
      : spread_(spread),
        raster_(raster),
        series_(series_of(spread, raster)),
        most_(frequency_count(series_)),
        across_(waves(series_, 0, most_, raster.width, raster.pitch.si())),
        down_(waves(series_, -most_, most_, raster.height, raster.pitch.si())),
        rows_(static_cast<std::size_t>(row_count() * spread.channels() * raster.width)) {}

  int row_count() const { return 2 * most_ + 1; }

  // Row k of frequencies at every column of pixels.
  void sum_frequencies(int k) {
    const double pitch = raster_.pitch.si();
    const double nu_y = (k - most_) / series_.period;
    const double pixel_y = sinc(kPi * nu_y * pitch);
    for (int j = 0; j <= most_; ++j) {
      const double nu_x = j / series_.period;
      const double scale = (j == 0 ? 1.0 : 2.0) * sinc(kPi * nu_x * pitch) * pixel_y;
      const auto value = spread_.otf({nu_x, nu_y});
      for (int c = 0; c < spread_.channels(); ++c) {
        const std::complex<double> h = value[static_cast<std::size_t>(c)] * scale;
        if (h != 0.0) add(h, &across_[at(j, raster_.width)], row(k, c));
      }
    }
  }

  void sum_rows(int y, Image& image) const {
    std::vector<double> sum(static_cast<std::size_t>(raster_.width));
    for (int c = 0; c < spread_.channels(); ++c) {
      std::ranges::fill(sum, 0.0);
      for (int k = 0; k < row_count(); ++k) {
        const std::complex<double> wave =
            down_[at(k, raster_.height) + static_cast<std::size_t>(y)];
        const std::complex<double>* terms = row(k, c);
        for (std::size_t x = 0; x < sum.size(); ++x) {
          sum[x] += wave.real() * terms[x].real() - wave.imag() * terms[x].imag();
        }
      }
      const double scale = 1.0 / (series_.period * series_.period);
      for (int x = 0; x < raster_.width; ++x) {
        image.at(x, y)[c] = static_cast<float>(sum[static_cast<std::size_t>(x)] * scale);
      }
    }
  }

 private:
  static std::size_t at(int row, int width) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  }
  const std::complex<double>* row(int k, int channel) const {
    return &rows_[at(k * spread_.channels() + channel, raster_.width)];
  }
  std::complex<double>* row(int k, int channel) {
    return &rows_[at(k * spread_.channels() + channel, raster_.width)];
  }
  void add(std::complex<double> h, const std::complex<double>* wave,
           std::complex<double>* sum) const {
    for (int x = 0; x < raster_.width; ++x) {
      sum[x] += std::complex<double>(h.real() * wave[x].real() - h.imag() * wave[x].imag(),
                                     h.real() * wave[x].imag() + h.imag() * wave[x].real());
    }
  }

  const PointSpread& spread_;
  PointSpreadRaster raster_;
  Series series_;
  int most_;
  std::vector<std::complex<double>> across_;
  std::vector<std::complex<double>> down_;
  std::vector<std::complex<double>> rows_;
};

Channels energy_of(const Image& image, Length pitch) {
  Channels energy = {};
  const double area = pitch.si() * pitch.si();
  for (std::size_t i = 0; i < image.pixels().size(); ++i) {
    energy[i % static_cast<std::size_t>(image.channels())] += area * image.pixels()[i];
  }
  return energy;
}

}  // namespace

PointSpreadImage point_spread_image(const PointSpread& spread, const PointSpreadRaster& raster,
                                    const RunControl& run) {
  require(raster);
  PointSpreadImage result{.density = Image(raster.width, raster.height, spread.channels())};
  if (spread.is_round()) {
    fill_round(spread, raster, result.density, run);
  } else {
    SeriesImage series(spread, raster);
    parallel_for(run, series.row_count(), [&](int k) { series.sum_frequencies(k); });
    parallel_for(run, raster.height, [&](int y) { series.sum_rows(y, result.density); });
  }
  result.energy = energy_of(result.density, raster.pitch);
  return result;
}

double point_spread_image_cost(const PointSpread& spread, const PointSpreadRaster& raster) {
  require(raster);
  const double pixels = static_cast<double>(raster.width) * raster.height;
  if (spread.is_round()) {
    const double nodes = nodes_a_side(pixel_phase(spread, raster));
    const double radii = half_diagonal(raster) / table_step(spread);
    return radii * spread.density_cost(0.0) + 0.75 * pixels * nodes * nodes;
  }
  const Series series = series_of(spread, raster);
  const double rows = 2.0 * series.most + 1.0;
  const double each = 0.1 * spread.channels();  // eight pixels at a time
  return 0.5 * rows * rows * (spread.otf_cost() + each * raster.width) + rows * pixels * each;
}

}  // namespace fstop
