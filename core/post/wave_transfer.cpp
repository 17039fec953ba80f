#include "core/post/wave_transfer.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <utility>

#include "core/optics/astigmatic_otf.h"
#include "core/optics/polygon_otf.h"
#include "core/optics/transfer.h"

namespace fstop {
namespace {

constexpr int kFirstIntervals = 8;
constexpr int kMostIntervals = 32;
constexpr int kMostOrder = 3;
constexpr int kAngles =
    6;  // over a quarter turn, both ends: harmonics up to 2 m = 8 are told apart
constexpr int kFieldNodes = 5;
// Beyond 48 Fresnel zones the shadow is the same all over the field: the terms of a hole of 36
// zones at 23 degrees change H by 0.007.
constexpr double kShadowDefocus = 300.0;
constexpr double kShadowFieldError = 0.007;
constexpr int kFieldStride = 4;  // the field's small changes need fewer frequencies

// Values of a transfer function on the radial grid, per channel.
using ChannelValues = std::array<std::vector<double>, 3>;

struct FrequencyGrid {
  double step = 0.0;  // cycles per metre of the picture
  int count = 0;
  double at(int i) const { return step * i; }
};

// Steps so fine that linear interpolation errs by U^2 h^2/32 < 1e-4 in H(s).
FrequencyGrid grid_for(const WaveTransferSpec& spec, double largest_defocus, double shortest) {
  const double radius = 0.5 * spec.pupil.diameter.si();
  const double cut_off = 2.0 * radius / (shortest * spec.pupil.image_distance.si()) / spec.scale;
  const double steps_to_cut_off = 1024.0 + 35.0 * largest_defocus;
  const double step = cut_off / steps_to_cut_off;
  const double reach = std::min(cut_off, spec.highest_frequency);
  return {.step = step, .count = static_cast<int>(std::ceil(reach / step)) + 2};
}

// s = nu lambda z/a for a frequency of the picture.
double reduced_per_frequency(const WaveTransferSpec& spec, Length wavelength) {
  return spec.scale * wavelength.si() * spec.pupil.image_distance.si() /
         (0.5 * spec.pupil.diameter.si());
}

// H of one wavelength at a field position tan^2(theta) = t and an angle psi off the radial axis.
class SingleColour {
 public:
  SingleColour(const WaveTransferSpec& spec, Length wavelength, double t, double psi)
      : per_frequency_(reduced_per_frequency(spec, wavelength)),
        cosine_(1.0 / std::sqrt(1.0 + t)),
        radial_(std::cos(psi) / (cosine_ * cosine_ * cosine_)),
        tangential_(std::sin(psi) / cosine_),
        on_axis_(reduced_defocus(spec.pupil, wavelength)),
        oblique_(on_axis_.defocus * cosine_ * cosine_ * cosine_, on_axis_.defocus * cosine_),
        is_oblique_(t > 0.0) {}

  double operator()(double frequency) const noexcept {
    const double s = frequency * per_frequency_;
    return is_oblique_ ? oblique_({s * radial_, s * tangential_}) : on_axis_.otf(s);
  }

 private:
  struct OnAxis {
    explicit OnAxis(double U) : defocus(U), otf(U) {}
    double defocus;
    DefocusOtf otf;
  };
  double per_frequency_;
  double cosine_;
  double radial_;
  double tangential_;
  OnAxis on_axis_;
  AstigmaticOtf oblique_;
  bool is_oblique_;
};

void add_colour(const WaveTransferSpec& spec, const FrequencyGrid& grid,
                const SpectralSample& sample, double t, double psi, ChannelValues& sums) {
  const bool seen = std::ranges::any_of(sample.weight, [](double w) { return w > 1e-6; });
  if (!seen) return;
  const SingleColour otf(spec, sample.wavelength, t, psi);
  for (int i = 0; i < grid.count; ++i) {
    const double value = otf(grid.at(i));
    for (std::size_t c = 0; c < 3; ++c) {
      sums[c][static_cast<std::size_t>(i)] += sample.weight[c] * value;
    }
  }
}

ChannelValues transfer_at(const WaveTransferSpec& spec, const FrequencyGrid& grid,
                          std::span<const SpectralSample> colours, double t, double psi) {
  ChannelValues values;
  for (auto& channel : values) channel.resize(static_cast<std::size_t>(grid.count));
  for (const SpectralSample& colour : colours) {
    if (!spec.stop.stop_requested()) add_colour(spec, grid, colour, t, psi, values);
  }
  return values;
}

double largest_difference(const ChannelValues& a, const ChannelValues& b) {
  double worst = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < a[c].size(); ++i) {
      worst = std::max(worst, std::abs(a[c][i] - b[c][i]));
    }
  }
  return worst;
}

struct Colours {
  std::vector<SpectralSample> samples;
  double error = 0.0;
};

// Doubles the wavelengths until the transfer on the axis changes by no more than the tolerance.
Colours enough_colours(const WaveTransferSpec& spec, const FrequencyGrid& grid,
                       ChannelValues& on_axis) {
  Colours colours{.samples = picture_wavelengths(spec.light, kFirstIntervals)};
  on_axis = transfer_at(spec, grid, colours.samples, 0.0, 0.0);
  if (spec.light.monochromatic) return colours;
  for (int intervals = 2 * kFirstIntervals; intervals <= kMostIntervals; intervals *= 2) {
    colours.samples = picture_wavelengths(spec.light, intervals);
    ChannelValues finer = transfer_at(spec, grid, colours.samples, 0.0, 0.0);
    colours.error = largest_difference(on_axis, finer);
    on_axis = std::move(finer);
    if (colours.error <= spec.tolerance) break;
  }
  return colours;
}

RadialTable table_of(const FrequencyGrid& grid, const std::vector<double>& values) {
  std::vector<float> floats(values.size());
  std::ranges::transform(values, floats.begin(), [](double v) { return static_cast<float>(v); });
  return {grid.step, std::move(floats)};
}

std::vector<FieldTerm> terms_of_order(int order) {
  std::vector<FieldTerm> terms;
  for (int m = 0; m <= order; ++m) {
    for (int power = m; power <= order; ++power) terms.push_back({.harmonic = m, .power = power});
  }
  return terms;
}

// Solves a small linear system by elimination with pivots.
std::vector<double> solved(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t r = k + 1; r < n; ++r) {
      if (std::abs(a[r][k]) > std::abs(a[pivot][k])) pivot = r;
    }
    std::swap(a[k], a[pivot]);
    std::swap(b[k], b[pivot]);
    for (std::size_t r = k + 1; r < n; ++r) {
      const double factor = a[r][k] / a[k][k];
      for (std::size_t c = k; c < n; ++c) a[r][c] -= factor * a[k][c];
      b[r] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t c = k + 1; c < n; ++c) b[k] -= a[k][c] * b[c];
    b[k] /= a[k][k];
  }
  return b;
}

// Least squares by t^first, ..., t^last over the nodes: the rows that turn values at the nodes
// into coefficients.
std::vector<std::vector<double>> fit_rows(std::span<const double> nodes, int first, int last) {
  const auto unknowns = static_cast<std::size_t>(std::max(0, last - first + 1));
  std::vector<std::vector<double>> normal(unknowns, std::vector<double>(unknowns));
  const auto power = [&](std::size_t n, std::size_t k) {
    return std::pow(nodes[n], first + static_cast<int>(k));
  };
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (std::size_t k = 0; k < unknowns; ++k) {
      for (std::size_t l = 0; l < unknowns; ++l) normal[k][l] += power(n, k) * power(n, l);
    }
  }
  std::vector<std::vector<double>> rows(unknowns, std::vector<double>(nodes.size()));
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    std::vector<double> right(unknowns);
    for (std::size_t k = 0; k < unknowns; ++k) right[k] = power(n, k);
    const std::vector<double> column = solved(normal, right);
    for (std::size_t k = 0; k < unknowns; ++k) rows[k][n] = column[k];
  }
  return rows;
}

// H sampled over the field: at every node of t, as a share of the limit, the harmonics in the
// angle off the radial axis, less the transfer on the axis.
struct FieldSamples {
  std::vector<double> nodes = {};
  std::vector<std::vector<ChannelValues>> changes = {};  // [node][harmonic]
};

FieldSamples field_samples(const WaveTransferSpec& spec, const FrequencyGrid& grid,
                           std::span<const SpectralSample> colours) {
  FieldSamples samples;
  const ChannelValues on_axis = transfer_at(spec, grid, colours, 0.0, 0.0);
  for (int node = 1; node <= kFieldNodes; ++node) {
    // Chebyshev's extrema: a polynomial of fewer terms shows its error at them.
    const double place = 0.5 * (1.0 - std::cos(std::numbers::pi * node / kFieldNodes));
    samples.nodes.push_back(place);
    std::vector<ChannelValues> harmonics(kMostOrder + 1, on_axis);
    for (auto& harmonic : harmonics) {
      for (auto& channel : harmonic) std::ranges::fill(channel, 0.0);
    }
    for (int j = 0; j < kAngles; ++j) {
      const double psi = 0.5 * std::numbers::pi * j / (kAngles - 1);
      const ChannelValues values = transfer_at(spec, grid, colours, spec.field_limit * place, psi);
      const double end = (j == 0 || j == kAngles - 1 ? 0.5 : 1.0) / (kAngles - 1);
      for (int m = 0; m <= kMostOrder; ++m) {
        const double weight = end * (m == 0 ? 1.0 : 2.0 * std::cos(2.0 * m * psi));
        ChannelValues& sum = harmonics[static_cast<std::size_t>(m)];
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t i = 0; i < sum[c].size(); ++i) {
            sum[c][i] += weight * (values[c][i] - on_axis[c][i]);
          }
        }
      }
    }
    samples.changes.push_back(std::move(harmonics));
  }
  return samples;
}

// Coefficients of the terms beyond (0, 0), in powers of t.
struct FieldFit {
  std::vector<ChannelValues> coefficients = {};  // per term; that of (0, 0) is empty
  double error = 0.0;
};

FieldFit fitted(const FieldSamples& samples, double limit, int order) {
  FieldFit fit;
  const std::size_t count = samples.changes[0][0][0].size();
  std::vector<double> errors(3 * count);
  for (int m = 0; m <= kMostOrder; ++m) {
    const int first = std::max(m, 1);
    const auto rows = fit_rows(samples.nodes, first, order);
    const auto change = [&](std::size_t n, std::size_t c, std::size_t i) {
      return samples.changes[n][static_cast<std::size_t>(m)][c][i];
    };
    std::vector<ChannelValues> found(rows.size());
    for (std::size_t c = 0; c < 3; ++c) {
      for (auto& values : found) values[c].resize(count);
      for (std::size_t i = 0; i < count; ++i) {
        double worst = 0.0;
        for (std::size_t k = 0; k < rows.size(); ++k) {
          for (std::size_t n = 0; n < samples.nodes.size(); ++n) {
            found[k][c][i] += rows[k][n] * change(n, c, i);
          }
        }
        for (std::size_t n = 0; n < samples.nodes.size(); ++n) {
          double left = change(n, c, i);
          for (std::size_t k = 0; k < rows.size(); ++k) {
            left -= found[k][c][i] * std::pow(samples.nodes[n], first + static_cast<int>(k));
          }
          worst = std::max(worst, std::abs(left));
        }
        errors[3 * i + c] += worst;
      }
    }
    if (m == 0) fit.coefficients.emplace_back();
    for (std::size_t k = 0; k < found.size(); ++k) {
      const double scale = std::pow(limit, -(first + static_cast<int>(k)));
      for (auto& channel : found[k]) {
        for (double& value : channel) value *= scale;
      }
      fit.coefficients.push_back(std::move(found[k]));
    }
  }
  fit.error = *std::ranges::max_element(errors);
  return fit;
}

std::array<RadialTable, 3> tables_of(const FrequencyGrid& grid, const ChannelValues& values) {
  return {table_of(grid, values[0]), table_of(grid, values[1]), table_of(grid, values[2])};
}

void add_field_terms(const WaveTransferSpec& spec, const FrequencyGrid& grid,
                     WaveTransfer& transfer) {
  const FrequencyGrid coarse{.step = kFieldStride * grid.step,
                             .count = grid.count / kFieldStride + 2};
  const FieldSamples samples =
      field_samples(spec, coarse, picture_wavelengths(spec.light, kFirstIntervals));
  int order = 0;
  FieldFit fit = fitted(samples, spec.field_limit, order);
  while (fit.error > spec.tolerance && order < kMostOrder) {
    fit = fitted(samples, spec.field_limit, ++order);
  }
  transfer.field_error = fit.error;
  transfer.terms = terms_of_order(order);
  for (std::size_t term = 1; term < transfer.terms.size(); ++term) {
    transfer.tables.push_back(tables_of(coarse, fit.coefficients[term]));
  }
}

// The upright picture is the real one turned round: the conjugate.
void add_polygon(const WaveTransferSpec& spec, double largest_defocus, double shortest,
                 int intervals, WaveTransfer& transfer) {
  const double radius = 0.5 * spec.pupil.diameter.si();
  const double cut_off = 2.0 * aperture_circumradius(spec.aperture) * radius /
                         (shortest * spec.pupil.image_distance.si()) / spec.scale;
  const double step = cut_off / (384.0 + 18.0 * largest_defocus);
  const int count =
      static_cast<int>(std::ceil(std::min(cut_off, spec.highest_frequency) / step)) + 2;
  struct Colour {
    PolygonOtf otf;
    double per_frequency;
    std::array<double, 3> weight;
  };
  std::vector<Colour> colours;
  for (const SpectralSample& sample : picture_wavelengths(spec.light, intervals)) {
    if (std::ranges::all_of(sample.weight, [](double w) { return w <= 1e-6; })) continue;
    colours.push_back({PolygonOtf(spec.aperture, reduced_defocus(spec.pupil, sample.wavelength)),
                       reduced_per_frequency(spec, sample.wavelength), sample.weight});
  }
  for (std::size_t c = 0; c < 3; ++c) {
    transfer.polygon.emplace_back(spec.aperture, step, count, [&](Vec2 nu) {
      std::complex<double> sum = 0.0;
      for (const Colour& colour : colours) {
        if (colour.weight[c] <= 1e-6 || spec.stop.stop_requested()) continue;
        const double s = colour.per_frequency;
        sum += colour.weight[c] * std::conj(colour.otf({nu.x * s, nu.y * s}));
      }
      return sum;
    });
  }
}

}  // namespace

RadialTable::RadialTable(double step, std::vector<float> values) : values_(std::move(values)) {
  if (values_.size() < 2) values_.resize(2);
  per_step_ = static_cast<float>(1.0 / step);
  last_ = static_cast<float>(values_.size() - 1);
}

RadialTable RadialTable::without_halo(double amplitude, double decay) const {
  RadialTable table = *this;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const double frequency = static_cast<double>(i) / static_cast<double>(per_step_);
    table.values_[i] -= static_cast<float>(amplitude * std::exp(-frequency * decay));
  }
  return table;
}

std::vector<SpectralSample> picture_wavelengths(const PictureLight& light, int intervals) {
  if (light.monochromatic) return {{.wavelength = light.wavelength, .weight = {1.0, 1.0, 1.0}}};
  return spectral_samples(SpectralBands::sensor, intervals);
}

std::array<double, 3> mean_wavelengths(const PictureLight& light) {
  std::array<double, 3> mean = {};
  for (const SpectralSample& sample : picture_wavelengths(light, kMostIntervals)) {
    for (std::size_t c = 0; c < 3; ++c) mean[c] += sample.weight[c] * sample.wavelength.si();
  }
  return mean;
}

WaveTransfer wave_transfer(const WaveTransferSpec& spec) {
  double shortest = 1.0;
  double largest_defocus = 0.0;
  WaveTransfer transfer;
  for (const SpectralSample& sample : picture_wavelengths(spec.light, kMostIntervals)) {
    if (std::ranges::all_of(sample.weight, [](double w) { return w <= 1e-6; })) continue;
    require_wave_model(spec.pupil, sample.wavelength);
    shortest = std::min(shortest, sample.wavelength.si());
    largest_defocus =
        std::max(largest_defocus, std::abs(reduced_defocus(spec.pupil, sample.wavelength)));
    transfer.model_error =
        std::max(transfer.model_error, wave_model_error(spec.pupil, sample.wavelength).total());
  }
  const FrequencyGrid grid = grid_for(spec, largest_defocus, shortest);
  ChannelValues on_axis;
  const Colours colours = enough_colours(spec, grid, on_axis);
  transfer.wavelengths = static_cast<int>(colours.samples.size());
  transfer.spectral_error = colours.error;

  transfer.terms = terms_of_order(0);
  transfer.tables.push_back(tables_of(grid, on_axis));
  if (spec.aperture.blades >= 3) {
    add_polygon(spec, largest_defocus, shortest, transfer.wavelengths - 1, transfer);
  }
  if (spec.field_limit > 0.0 && largest_defocus > kShadowDefocus) {
    transfer.field_error = kShadowFieldError;
  } else if (spec.field_limit > 0.0) {
    add_field_terms(spec, grid, transfer);
  }
  return transfer;
}

}  // namespace fstop
