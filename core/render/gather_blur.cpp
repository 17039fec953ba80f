#include "core/render/gather_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/sampling/sequence.h"
#include "core/simd.h"

namespace fstop {
namespace {

constexpr int kGatherTile = 16;
constexpr std::size_t kRow = kGatherTile;  // pixels of a tile's row: lanes
constexpr double kExactReach = 16.0;       // pixels; up to here every pixel is a tap
constexpr double kRoundPx = 3.0;  // of smaller blur, blades do not show on a lattice of pixels
constexpr double kCellsAcross = kExactReach / 2.0;

// How large the pupil's outline has to be to reach a point.
class Outline {
 public:
  explicit Outline(const Aperture& aperture) : corners_(aperture_vertices(aperture)) {}

  double size_at(Vec2 p) const {
    if (corners_.empty()) return std::hypot(p.x, p.y);
    double size = 0.0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const Vec2 a = corners_[i];
      const Vec2 b = corners_[(i + 1) % corners_.size()];
      // The edge through a and b is where this is 1.
      const double along = (p.x * (b.y - a.y) - p.y * (b.x - a.x)) / (a.x * b.y - a.y * b.x);
      size = std::max(size, along);
    }
    return size;
  }

 private:
  std::vector<Vec2> corners_;
};

// The smallest disc that reaches across a tap.
float size_of(const GatherTap& tap) { return std::min({tap.near, tap.far, tap.round}); }

// Divides the square of pixels [x, x + side) x [y, y + side) into cells.
class TapCells {
 public:
  TapCells(const Aperture& aperture, double reach) : outline_(aperture), reach_(reach) {}

  void divide(int x, int y, int side) {
    const double distance = std::hypot(outside(x, side), outside(y, side));
    if (side > 1 && side * kCellsAcross > distance) {
      const int half = side / 2;
      for (const int dy : {0, half}) {
        for (const int dx : {0, half}) divide(x + dx, y + dy, half);
      }
      return;
    }
    add(x, y, side);
  }
  std::vector<GatherTap> taps() && { return std::move(taps_); }

 private:
  static int outside(int begin, int side) { return std::max({0, begin, 1 - begin - side}); }

  // One pixel of a cell, always the same.
  void add(int x, int y, int side) {
    const std::uint32_t chance =
        hash_of(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    const auto mask = static_cast<std::uint32_t>(side - 1);
    GatherTap tap{.x = x + static_cast<int>(chance & mask),
                  .y = y + static_cast<int>((chance >> 16) & mask),
                  .area = static_cast<float>(side) * static_cast<float>(side)};
    // Light from tap t to pixel 0 goes by -t; a far point's disc lies like the pupil, a near
    // point's is turned by half a turn.
    const Vec2 t{static_cast<double>(tap.x), static_cast<double>(tap.y)};
    tap.near = static_cast<float>(outline_.size_at(t));
    tap.far = static_cast<float>(outline_.size_at({-t.x, -t.y}));
    tap.round = static_cast<float>(std::hypot(t.x, t.y));
    if (size_of(tap) < reach_) taps_.push_back(tap);
  }

  Outline outline_;
  double reach_;
  std::vector<GatherTap> taps_ = {};
};

// A disc with a soft edge from size - 1/2 to size + 1/2 whose second moment is that of a sharp
// disc of `radius`: size^2 = radius^2 - 5/12. Where that is small, the pixel itself and its four
// neighbours have that moment, radius^2/4 along each axis; both meet at radius 1.
struct Disc {
  float edge = 0.5F;     // the size where the weight has fallen to 0
  float density = 1.0F;  // weight of a pixel inside

  static Disc of(double radius) {
    const double square = radius * radius;
    if (radius < 1.0) {
      const double centre = 1.0 - square / 2.0;
      return {static_cast<float>(1.0 + square / 8.0 / centre), static_cast<float>(centre)};
    }
    const double size = std::sqrt(square - 5.0 / 12.0);
    const double area = std::numbers::pi * (size * size + 1.0 / 12.0);
    return {static_cast<float>(size + 0.5), static_cast<float>(1.0 / area)};
  }
};

// The sharp picture, plane by plane, rows long enough for whole lanes.
struct Planes {
  Planes(const SharpPicture& sharp, const Aperture& aperture)
      : width(sharp.color.width()),
        height(sharp.color.height()),
        stride(static_cast<std::size_t>(width) + kRow) {
    for (auto* plane : {&red, &green, &blue, &coc, &edge, &density}) {
      plane->resize(stride * static_cast<std::size_t>(height));
    }
    const double stretch = std::sqrt(2.0 * aperture_mean_square_radius(aperture));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = index(x, y);
        red[i] = sharp.color.at(x, y)[0];
        green[i] = sharp.color.at(x, y)[1];
        blue[i] = sharp.color.at(x, y)[2];
        coc[i] = *sharp.coc.at(x, y);
        const double blur = std::abs(static_cast<double>(coc[i]));
        const Disc disc = Disc::of(0.5 * blur * (blur < kRoundPx ? stretch : 1.0));
        edge[i] = disc.edge;
        density[i] = disc.density;
      }
    }
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
  }

  int width;
  int height;
  std::size_t stride;
  std::vector<float> red = {}, green = {}, blue = {};
  std::vector<float> coc = {}, edge = {}, density = {};
};

struct alignas(64) RowSums {
  std::array<float, kRow> red = {}, green = {}, blue = {}, weight = {};
};

// Adds a tap's light to the row of pixels that starts at index `here`.
FSTOP_KERNEL void add_tap(const Planes& planes, const GatherTap& tap, std::size_t here,
                          std::size_t there, RowSums& sums) {
  const float* const own_coc = planes.coc.data() + here;
  const float* const own_edge = planes.edge.data() + here;
  const float* const own_density = planes.density.data() + here;
  const float* const coc = planes.coc.data() + there;
  const float* const edge = planes.edge.data() + there;
  const float* const density = planes.density.data() + there;
  const float* const red = planes.red.data() + there;
  const float* const green = planes.green.data() + there;
  const float* const blue = planes.blue.data() + there;
  for (std::size_t k = 0; k < kRow; ++k) {
    // Signed blur grows with depth: a larger one lies behind.
    const float limit_edge = own_edge[k];
    const float limit_density = own_density[k];
    const float tap_edge = edge[k];
    const float tap_density = density[k];
    const bool held =
        static_cast<int>(coc[k] > own_coc[k]) & static_cast<int>(tap_edge > limit_edge);
    const float until = held ? limit_edge : tap_edge;
    const float full = held ? limit_density : tap_density;
    const float outlined = coc[k] < 0.0F ? tap.near : tap.far;
    const float size = std::abs(coc[k]) < static_cast<float>(kRoundPx) ? tap.round : outlined;
    const float rise = std::min(1.0F, std::max(0.0F, until - size));
    const float weight = rise * full * tap.area;
    sums.weight[k] += weight;
    sums.red[k] += weight * red[k];
    sums.green[k] += weight * green[k];
    sums.blue[k] += weight * blue[k];
  }
}

FSTOP_KERNEL void add_taps(const Planes& planes, const std::vector<GatherTap>& taps,
                           std::size_t count, std::size_t here, RowSums& sums) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::ptrdiff_t step = taps[i].y * static_cast<std::ptrdiff_t>(planes.stride) + taps[i].x;
    add_tap(planes, taps[i], here,
            static_cast<std::size_t>(static_cast<std::ptrdiff_t>(here) + step), sums);
  }
}
FSTOP_AVX512 void add_taps_wide(const Planes& planes, const std::vector<GatherTap>& taps,
                                std::size_t count, std::size_t here, RowSums& sums) {
  add_taps(planes, taps, count, here, sums);
}

// The result's tiles of pixels, and how large discs are that reach into each.
class TileReach {
 public:
  TileReach(const Planes& planes, int margin, double stretch)
      : columns_((planes.width + kGatherTile - 1) / kGatherTile),
        rows_((planes.height + kGatherTile - 1) / kGatherTile),
        edges_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)),
        margin_(margin),
        stretch_(stretch) {
    for (int y = 0; y < planes.height; ++y) {
      for (int x = 0; x < planes.width; ++x) {
        float& edge = at(x / kGatherTile, y / kGatherTile);
        edge = std::max(edge, planes.edge[planes.index(x, y)]);
      }
    }
  }

  // Of the discs that may reach the tile whose upper left pixel is (x, y).
  float reach(int x, int y) {
    float reach = 0.0F;
    const int left = (x - margin_) / kGatherTile;
    const int right = std::min(columns_ - 1, (x + kGatherTile - 1 + margin_) / kGatherTile);
    const int top = (y - margin_) / kGatherTile;
    const int bottom = std::min(rows_ - 1, (y + kGatherTile - 1 + margin_) / kGatherTile);
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const float edge = at(column, row);
        const double gap = std::hypot(between(column, x), between(row, y));
        if (edge * stretch_ >= gap) reach = std::max(reach, edge);
      }
    }
    return reach;
  }

 private:
  float& at(int column, int row) {
    return edges_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }
  // Pixels between a tile of the grid and the tile that starts at `begin`.
  static int between(int tile, int begin) {
    const int first = tile * kGatherTile;
    return std::max({0, begin - (first + kGatherTile - 1), first - (begin + kGatherTile - 1)});
  }

  int columns_;
  int rows_;
  std::vector<float> edges_;
  int margin_;
  double stretch_;
};

// One row of a tile, from (x, y) of the sharp picture.
void gather_row(const Planes& planes, const std::vector<GatherTap>& taps, std::size_t count, int x,
                int y, int margin, Image& image) {
  RowSums sums;
  const std::size_t here = planes.index(x, y);
  if (has_avx512()) {
    add_taps_wide(planes, taps, count, here, sums);
  } else {
    add_taps(planes, taps, count, here, sums);
  }
  const int left = x - margin;
  const int lanes = std::min(kGatherTile, image.width() - left);
  for (int lane = 0; lane < lanes; ++lane) {
    const auto k = static_cast<std::size_t>(lane);
    float* pixel = image.at(left + lane, y - margin);
    pixel[0] = sums.red[k] / sums.weight[k];
    pixel[1] = sums.green[k] / sums.weight[k];
    pixel[2] = sums.blue[k] / sums.weight[k];
  }
}

}  // namespace

std::vector<GatherTap> gather_taps(const Aperture& aperture, double radius) {
  const double reach = radius + 1.0;
  const double extent = reach * aperture_circumradius(aperture);
  int side = 1;
  while (side < extent + 1.0) side *= 2;
  TapCells cells(aperture, reach);
  for (const int y : {-side, 0}) {
    for (const int x : {-side, 0}) cells.divide(x, y, side);
  }
  std::vector<GatherTap> taps = std::move(cells).taps();
  std::ranges::stable_sort(taps, {}, size_of);
  return taps;
}

int gather_margin(const Aperture& aperture, double blur_px) {
  return static_cast<int>(std::ceil((0.5 * blur_px + 1.0) * aperture_circumradius(aperture)));
}

Image gathered(const SharpPicture& sharp, const Aperture& aperture, const RunControl& run) {
  const int margin = sharp.margin;
  const Planes planes(sharp, aperture);
  const double stretch = aperture_circumradius(aperture);
  std::vector<GatherTap> taps = gather_taps(aperture, margin / stretch - 1.0);
  std::erase_if(taps, [&](const GatherTap& tap) {
    return std::max(std::abs(tap.x), std::abs(tap.y)) > margin;
  });
  TileReach tiles(planes, margin, stretch);
  Image image(planes.width - 2 * margin, planes.height - 2 * margin, 3);
  const int columns = (image.width() + kGatherTile - 1) / kGatherTile;
  const int rows = (image.height() + kGatherTile - 1) / kGatherTile;
  parallel_for(run, columns * rows, [&](int tile) {
    const int x = margin + tile % columns * kGatherTile;
    const int top = margin + tile / columns * kGatherTile;
    const auto end = std::ranges::upper_bound(taps, tiles.reach(x, top), {}, size_of);
    const auto count = static_cast<std::size_t>(end - taps.begin());
    const int bottom = std::min(top + kGatherTile, margin + image.height());
    for (int y = top; y < bottom; ++y) gather_row(planes, taps, count, x, y, margin, image);
  });
  throw_if_stopped(run);
  return image;
}

}  // namespace fstop
