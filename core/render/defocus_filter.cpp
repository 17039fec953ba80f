#include "core/render/defocus_filter.h"

#include <algorithm>
#include <cmath>

#include "core/film/square_sums.h"
#include "core/simd.h"

namespace fstop {
namespace {

constexpr int kSide = DefocusFilter::kTileSide;
constexpr int kReach = DefocusFilter::kLargestRadius;
constexpr int kWindow = kSide + 2 * kReach;  // pixels along a tile's surroundings
constexpr int kRow = 3 * kSide;              // floats of a tile's row
static_assert(kSide % kBlockSide == 0);

using Weights = std::array<float, 2 * kReach + 1>;

// Along one axis, for offsets -r to r. The weights that keep parabolas:
// (3 (3r^2 + 3r - 1) - 15 i^2)/((2r - 1)(2r + 1)(2r + 3)).
Weights weights_of(int radius, bool keeps_parabolas) {
  Weights weights = {};
  const double r = radius;
  for (int i = -radius; i <= radius; ++i) {
    const double mean = 1.0 / (2.0 * r + 1.0);
    const double parabola = (3.0 * (3.0 * r * r + 3.0 * r - 1.0) - 15.0 * i * i) /
                            ((2.0 * r - 1.0) * (2.0 * r + 1.0) * (2.0 * r + 3.0));
    weights[static_cast<std::size_t>(i + radius)] =
        static_cast<float>(keeps_parabolas ? parabola : mean);
  }
  return weights;
}

// A tile and its surroundings, channels interleaved.
struct alignas(64) Surroundings {
  std::array<std::array<float, 3 * kWindow>, kWindow> rows;
};
struct alignas(64) Strip {
  std::array<std::array<float, kRow>, kWindow> rows;
};

FSTOP_KERNEL void smooth(const Surroundings& in, int radius, const Weights& weights, Strip& strip,
                         DefocusFilter::Tile& out) {
  for (int y = 0; y < kSide + 2 * radius; ++y) {
    std::array<float, kRow> sum = {};
    for (int i = 0; i <= 2 * radius; ++i) {
      const float w = weights[static_cast<std::size_t>(i)];
      const float* from = in.rows[static_cast<std::size_t>(y)].data() + 3 * i;
      for (int x = 0; x < kRow; ++x) sum[static_cast<std::size_t>(x)] += w * from[x];
    }
    strip.rows[static_cast<std::size_t>(y)] = sum;
  }
  for (int y = 0; y < kSide; ++y) {
    std::array<float, kRow> sum = {};
    for (int i = 0; i <= 2 * radius; ++i) {
      const float w = weights[static_cast<std::size_t>(i)];
      const auto& from = strip.rows[static_cast<std::size_t>(y + i)];
      for (int x = 0; x < kRow; ++x) {
        sum[static_cast<std::size_t>(x)] += w * from[static_cast<std::size_t>(x)];
      }
    }
    out.rows[static_cast<std::size_t>(y)] = sum;
  }
}
FSTOP_AVX512 void smooth_wide(const Surroundings& in, int radius, const Weights& weights,
                              Strip& strip, DefocusFilter::Tile& out) {
  smooth(in, radius, weights, strip, out);
}

int mirrored_index(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  i = std::abs(i) % period;
  return i < size ? i : period - i;
}

// Smallest blur diameter of each tile's own blocks, pixels.
std::vector<float> tile_blurs(const ReplicateFilm& film, double blur_px, int columns, int rows) {
  std::vector<float> blurs(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows),
                           1e30F);
  const BlockGrid& grid = film.grid();
  for (std::size_t block = 0; block < grid.count(); ++block) {
    const double exact = blur_px * static_cast<double>(film.least_defocus(block));
    const auto blur = static_cast<float>(std::min(exact, 1e30));
    const int reach = grid.stride(block) * (kBlockSide - 1);
    for (int y = grid.top(block) / kSide; y <= (grid.top(block) + reach) / kSide && y < rows; ++y) {
      for (int x = grid.left(block) / kSide; x <= (grid.left(block) + reach) / kSide; ++x) {
        if (x >= columns) break;
        float& least = blurs[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                             static_cast<std::size_t>(x)];
        least = std::min(least, blur);
      }
    }
  }
  return blurs;
}

// Light brighter than a pixel shows stays where it is.
void sharpen_bright(const Image& picture, int columns, std::vector<float>& blurs,
                    const RunControl& run) {
  const int tile_rows = (picture.height() + kSide - 1) / kSide;
  parallel_for(run, tile_rows, [&](int row) {
    float* blur = blurs.data() + static_cast<std::ptrdiff_t>(row) * columns;
    for (int y = row * kSide; y < std::min((row + 1) * kSide, picture.height()); ++y) {
      for (int column = 0; column < columns; ++column) {
        const int left = column * kSide;
        const int count = 3 * (std::min(left + kSide, picture.width()) - left);
        const float* p = picture.at(left, y);
        bool is_bright = false;
        for (int i = 0; i < count; ++i) is_bright |= p[i] > 1.0F;
        if (is_bright) blur[column] = 0.0F;
      }
    }
  });
}

}  // namespace

DefocusFilter::DefocusFilter(const ReplicateFilm& film, const Image& a, const Image& b,
                             double blur_px, const FilterKind& kind, const RunControl& run)
    : columns_((film.grid().width + kTileSide - 1) / kTileSide),
      rows_((film.grid().height + kTileSide - 1) / kTileSide),
      kind_(kind) {
  std::vector<float> blurs = tile_blurs(film, blur_px, columns_, rows_);
  sharpen_bright(a, columns_, blurs, run);
  sharpen_bright(b, columns_, blurs, run);
  // Parabolas are kept by three weights only as they are.
  const int least = kind.keeps_parabolas ? 2 : 1;
  const auto at = [&](int column, int row) {
    return blurs[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      float blur = 1e30F;
      for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y) {
        for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x) {
          blur = std::min(blur, at(x, y));
        }
      }
      const double wanted = std::floor(kind.share * static_cast<double>(blur));
      const int radius = static_cast<int>(std::min(wanted, double(kLargestRadius)));
      radii_.push_back(static_cast<std::uint8_t>(radius >= least ? radius : 0));
      filters_ = filters_ || radius >= least;
    }
  }
}

void DefocusFilter::filter_tile(const Image& picture, int column, int row,
                                Tile& result) const noexcept {
  const int left = column * kTileSide;
  const int top = row * kTileSide;
  const int width = std::min(kTileSide, picture.width() - left);
  const int reach = radius(column, row);
  if (reach == 0) {
    for (int y = 0; y < std::min(kTileSide, picture.height() - top); ++y) {
      const float* line = picture.at(left, top + y);
      std::copy(line, line + 3 * width, result.rows[static_cast<std::size_t>(y)].begin());
    }
    return;
  }
  Surroundings in;
  const bool inside = left >= reach && left + kSide + reach <= picture.width();
  for (int y = 0; y < kSide + 2 * reach; ++y) {
    const int from = mirrored_index(top + y - reach, picture.height());
    float* to = in.rows[static_cast<std::size_t>(y)].data();
    if (inside) {
      const float* begin = picture.at(left - reach, from);
      std::copy(begin, begin + 3 * (kSide + 2 * reach), to);
      continue;
    }
    for (int x = 0; x < kSide + 2 * reach; ++x) {
      const float* p = picture.at(mirrored_index(left + x - reach, picture.width()), from);
      std::copy(p, p + 3, to + 3 * x);
    }
  }
  const Weights weights = weights_of(reach, kind_.keeps_parabolas);
  Strip strip;
  if (has_avx512()) {
    smooth_wide(in, reach, weights, strip, result);
  } else {
    smooth(in, reach, weights, strip, result);
  }
}

Image DefocusFilter::applied(const Image& picture, const RunControl& run) const {
  Image result(picture.width(), picture.height(), 3);
  parallel_for(run, rows_, [&](int row) {
    Tile tile;
    for (int column = 0; column < columns_; ++column) {
      filter_tile(picture, column, row, tile);
      const int left = column * kTileSide;
      const int width = std::min(kTileSide, picture.width() - left);
      for (int y = row * kTileSide; y < std::min((row + 1) * kTileSide, picture.height()); ++y) {
        const auto& line = tile.rows[static_cast<std::size_t>(y - row * kTileSide)];
        std::copy(line.begin(), line.begin() + 3 * width, result.at(left, y));
      }
    }
  });
  return result;
}

namespace {

constexpr int kUnitTiles = 2;  // along the side of a unit of the certificate

// What a row of units adds to the certificate.
struct CertificateRow {
  SquareSums total = {};      // variance + bias of each unit
  SquareSums variances = {};  // apart
  SquareSums biases = {};
  double pixels = 0.0;
  using ByRadius = std::array<double, DefocusFilter::kLargestRadius + 1>;
  ByRadius raw = {};   // variance of the unfiltered picture
  ByRadius left = {};  // and of the filtered one
};

constexpr double kSharedUnits = 2.0;  // what neighbours share doubles their scatter
constexpr double kManyUnits = 32.0;

// Of so few units the bias is told badly: where its noise makes it negative, it must not hide the
// variance. Each part has a bound of its own, the bias by Student's t of two degrees of freedom.
double bound_of_few(const CertificateRow& all, double units) {
  constexpr double kQuantile = 2.92;
  const double mean = all.biases.mean(units);
  const double scatter = std::max(0.0, all.biases.sum_of_squares / units - mean * mean);
  const double bias = mean + kQuantile * std::sqrt(kSharedUnits * scatter / units);
  return all.variances.upper_95(units, kSharedUnits) + std::max(0.0, bias);
}

// Sums over the values of a tile, one for each of a row's.
struct TileSums {
  std::array<float, kRow> variance = {};
  std::array<float, kRow> bias = {};
  std::array<float, kRow> raw = {};

  static double total(const std::array<float, kRow>& lanes) {
    double sum = 0.0;
    for (const float lane : lanes) sum += static_cast<double>(lane);
    return sum;
  }
};

float clipped(float value) { return value < 0.0F ? 0.0F : (value > 1.0F ? 1.0F : value); }

// `count` values of both replicates, before and after the filter.
void add_row(const float* a, const float* b, const float* filtered_a, const float* filtered_b,
             std::size_t count, TileSums& sums) {
  for (std::size_t i = 0; i < count; ++i) {
    const float off = clipped(filtered_a[i]) - clipped(filtered_b[i]);
    const float before = clipped(a[i]) - clipped(b[i]);
    sums.variance[i] += off * off;
    sums.bias[i] += (filtered_a[i] - a[i]) * (filtered_b[i] - b[i]);
    sums.raw[i] += before * before;
  }
}

}  // namespace

FilterCertificate filter_certificate(const DefocusFilter& filter, const Image& a, const Image& b,
                                     int every, const RunControl& run) {
  const int unit_columns = (filter.columns() + kUnitTiles - 1) / kUnitTiles;
  const int unit_rows = (filter.rows() + kUnitTiles - 1) / kUnitTiles;
  std::vector<CertificateRow> rows(static_cast<std::size_t>((unit_rows + every - 1) / every));
  const auto measure_tile = [&](int column, int row) {
    TileSums sums;
    DefocusFilter::Tile of_a;
    DefocusFilter::Tile of_b;
    filter.filter_tile(a, column, row, of_a);
    filter.filter_tile(b, column, row, of_b);
    const int begin = column * kSide;
    const auto count = static_cast<std::size_t>(3 * (std::min(begin + kSide, a.width()) - begin));
    for (int y = row * kSide; y < std::min((row + 1) * kSide, a.height()); ++y) {
      const float* pa = a.at(begin, y);
      const float* pb = b.at(begin, y);
      const float* fa = of_a.rows[static_cast<std::size_t>(y - row * kSide)].data();
      const float* fb = of_b.rows[static_cast<std::size_t>(y - row * kSide)].data();
      if (count == kRow) {
        add_row(pa, pb, fa, fb, kRow, sums);  // of a known length
      } else {
        add_row(pa, pb, fa, fb, count, sums);
      }
    }
    return sums;
  };
  parallel_for(run, static_cast<int>(rows.size()), [&](int taken) {
    CertificateRow& result = rows[static_cast<std::size_t>(taken)];
    const int unit_row = std::min(taken * every + every / 2, unit_rows - 1);
    const int bottom = std::min(filter.rows(), (unit_row + 1) * kUnitTiles);
    for (int unit = 0; unit < unit_columns; ++unit) {
      double variance_here = 0.0;
      double bias_here = 0.0;
      const int right = std::min(filter.columns(), (unit + 1) * kUnitTiles);
      for (int row = unit_row * kUnitTiles; row < bottom; ++row) {
        for (int column = unit * kUnitTiles; column < right; ++column) {
          const TileSums sums = measure_tile(column, row);
          const auto radius = static_cast<std::size_t>(filter.radius(column, row));
          result.pixels += std::min(kSide, a.width() - column * kSide) *
                           std::min(kSide, a.height() - row * kSide);
          const double variance = 0.25 * TileSums::total(sums.variance);
          const double bias = TileSums::total(sums.bias);
          result.raw[radius] += 0.25 * TileSums::total(sums.raw);
          result.left[radius] += variance;
          variance_here += variance;
          bias_here += bias;
        }
      }
      result.total.add(variance_here + bias_here);
      result.variances.add(variance_here);
      result.biases.add(bias_here);
    }
  });
  CertificateRow all;
  for (const CertificateRow& row : rows) {  // in order: sums never depend on the threads
    all.total.add(row.total);
    all.variances.add(row.variances);
    all.biases.add(row.biases);
    all.pixels += row.pixels;
    for (std::size_t r = 0; r < row.raw.size(); ++r) {
      all.raw[r] += row.raw[r];
      all.left[r] += row.left[r];
    }
  }
  const double values = 3.0 * all.pixels;
  const double units = static_cast<double>(unit_columns) * static_cast<double>(rows.size());
  const double per_value = units / values;
  FilterCertificate result{.variance = all.variances.sum / values,
                           .bias_squared = all.biases.sum / values};
  result.mse = result.variance + std::max(0.0, result.bias_squared);
  const double upper =
      units < kManyUnits ? bound_of_few(all, units) : all.total.upper_95(units, kSharedUnits);
  result.mse_upper_95 = std::max(result.mse, per_value * upper);
  for (std::size_t r = 0; r < all.raw.size(); ++r) {
    result.gain[r] = all.raw[r] > 0.0 ? all.left[r] / all.raw[r] : 1.0;
  }
  return result;
}

Image error_tiles(const Image& a, const Image& b, const Image& filtered_a,
                  const Image& filtered_b) {
  Image image(a.width(), a.height(), 3);
  const auto value = [](const Image& from, int x, int y, int c) {
    return static_cast<double>(from.at(x, y)[c]);
  };
  for (int top = 0; top < a.height(); top += kErrorTile) {
    for (int left = 0; left < a.width(); left += kErrorTile) {
      const int right = std::min(a.width(), left + kErrorTile);
      const int bottom = std::min(a.height(), top + kErrorTile);
      for (int c = 0; c < 3; ++c) {
        double sum = 0.0;
        for (int y = top; y < bottom; ++y) {
          for (int x = left; x < right; ++x) {
            const double fa = value(filtered_a, x, y, c);
            const double fb = value(filtered_b, x, y, c);
            sum +=
                0.25 * (fa - fb) * (fa - fb) + (fa - value(a, x, y, c)) * (fb - value(b, x, y, c));
          }
        }
        const double mean = sum / (static_cast<double>(right - left) * (bottom - top));
        for (int y = top; y < bottom; ++y) {
          for (int x = left; x < right; ++x) {
            image.at(x, y)[c] = static_cast<float>(std::max(0.0, mean));
          }
        }
      }
    }
  }
  return image;
}

}  // namespace fstop
