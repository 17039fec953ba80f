#include "core/measure/profile_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <vector>

#include <opencv2/core.hpp>

#include "core/error.h"

namespace fstop {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFrequencyStep = 1.0 / 1024.0;  // cycles/px
constexpr double kHighestFrequency = 4.0;        // the pixel's box leaves under 1e-3/nu^2.5 there
constexpr double kPlaceStep = 1.0 / 16.0;        // px
constexpr double kScaleStep = 0.03;
constexpr int kParameters = 6;  // scale, offset, turn, dark, contrast, tilt
constexpr int kTile = 16;       // px

using Vector = cv::Vec<double, kParameters>;
using Matrix = cv::Matx<double, kParameters, kParameters>;

double sinc(double x) { return std::abs(x) < 1e-9 ? 1.0 : std::sin(kPi * x) / (kPi * x); }

// The profile of one scale at x >= 0, in steps of kPlaceStep from -kPlaceStep on.
class ProfileTable {
 public:
  ProfileTable(const ScaledTransfer& transfer, double scale, double slant, double reach) {
    std::vector<double> weights;
    const int count = static_cast<int>(kHighestFrequency / kFrequencyStep);
    for (int k = 0; k < count; ++k) {
      const double nu = (k + 0.5) * kFrequencyStep;
      const double box = sinc(nu * std::cos(slant)) * sinc(nu * std::sin(slant));
      weights.push_back(transfer(nu, scale) * box / (kPi * (k + 0.5)));
    }
    while (!weights.empty() && weights.back() == 0.0) weights.pop_back();
    const int places = static_cast<int>(std::ceil(reach / kPlaceStep)) + 4;
    for (int i = 0; i < places; ++i) values_.push_back(sum(weights, (i - 1) * kPlaceStep));
  }

  // Odd about 1/2; Lagrange's cubic through four places.
  double operator()(double x) const {
    const double at = std::abs(x) / kPlaceStep;
    const auto i = std::min(static_cast<std::size_t>(at), values_.size() - 4);
    const double t = at - static_cast<double>(i);
    const double above = -t * (t - 1.0) * (t - 2.0) / 6.0 * values_[i] +
                         (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * values_[i + 1] -
                         (t + 1.0) * t * (t - 2.0) / 2.0 * values_[i + 2] +
                         (t + 1.0) * t * (t - 1.0) / 6.0 * values_[i + 3];
    return 0.5 + std::copysign(above, x);
  }

 private:
  static double sum(const std::vector<double>& weights, double x) {
    const std::complex<double> turn = std::polar(1.0, 2.0 * kPi * kFrequencyStep * x);
    std::complex<double> phase = std::polar(1.0, kPi * kFrequencyStep * x);
    double value = 0.0;
    for (const double weight : weights) {
      value += weight * phase.imag();
      phase *= turn;
    }
    return value;
  }

  std::vector<double> values_;
};

struct Profile {
  double value = 0.0;
  double by_scale = 0.0;
  double by_place = 0.0;
};

// E as a parabola in the scale through three tables.
class ProfileFamily {
 public:
  ProfileFamily(const ScaledTransfer& transfer, double slant, double reach)
      : tables_{ProfileTable(transfer, 1.0 - kScaleStep, slant, reach),
                ProfileTable(transfer, 1.0, slant, reach),
                ProfileTable(transfer, 1.0 + kScaleStep, slant, reach)} {}

  Profile at(double x, double scale) const {
    constexpr double kStep = 0.01;  // px
    Profile profile;
    const auto [value, slope] = parabola(x, scale);
    profile.value = value;
    profile.by_scale = slope;
    profile.by_place =
        (parabola(x + kStep, scale)[0] - parabola(x - kStep, scale)[0]) / (2.0 * kStep);
    return profile;
  }

 private:
  std::array<double, 2> parabola(double x, double scale) const {
    const double low = tables_[0](x), middle = tables_[1](x), high = tables_[2](x);
    const double t = (scale - 1.0) / kScaleStep;
    const double first = 0.5 * (high - low);
    const double second = high - 2.0 * middle + low;
    return {middle + t * (first + 0.5 * t * second), (first + t * second) / kScaleStep};
  }

  std::array<ProfileTable, 3> tables_;
};

struct FittedPixel {
  Vec2 place = {};  // from the edge's point: x along the normal, y along the edge
  double value = 0.0;
  int tile = 0;
};

std::vector<FittedPixel> pixels_of(ImageView<const float> image, const SlantedEdgeSpec& spec,
                                   const SlantedEdge& edge) {
  std::vector<FittedPixel> pixels;
  const int tiles_across = image.width / kTile + 1;
  for (int y = spec.region.y; y < spec.region.y + spec.region.height; ++y) {
    for (int x = spec.region.x; x < spec.region.x + spec.region.width; ++x) {
      const Vec2 from = Vec2{x + 0.5, y + 0.5} - edge.point;
      const Vec2 place{from.x * edge.normal.x + from.y * edge.normal.y,
                       from.y * edge.normal.x - from.x * edge.normal.y};
      if (std::abs(place.x) > edge.reach) continue;
      pixels.push_back({place, image.at(x, y)[spec.channel], y / kTile * tiles_across + x / kTile});
    }
  }
  return pixels;
}

// What the fit knows at one set of parameters.
struct Normal {
  Matrix matrix = Matrix::zeros();
  Vector gradient = {};
  double squares = 0.0;
  std::map<int, Vector> by_tile = {};
};

Normal normal_equations(const std::vector<FittedPixel>& pixels, const ProfileFamily& family,
                        const Vector& p) {
  Normal normal;
  for (const FittedPixel& pixel : pixels) {
    const Profile e = family.at(pixel.place.x - p[1] - p[2] * pixel.place.y, p[0]);
    const Vector slopes{
        p[4] * e.by_scale, -p[4] * e.by_place, -p[4] * e.by_place * pixel.place.y, 1.0,
        e.value,           pixel.place.x};
    const double residual = pixel.value - p[3] - p[4] * e.value - p[5] * pixel.place.x;
    normal.matrix += slopes * slopes.t();
    normal.gradient += residual * slopes;
    normal.by_tile[pixel.tile] += residual * slopes;
    normal.squares += residual * residual;
  }
  return normal;
}

double standard_error(const Normal& normal, std::size_t pixels) {
  const Matrix inverse = normal.matrix.inv(cv::DECOMP_CHOLESKY);
  Matrix scatter = Matrix::zeros();
  for (const auto& [tile, gradient] : normal.by_tile) scatter += gradient * gradient.t();
  const auto tiles = static_cast<double>(normal.by_tile.size());
  const double few = tiles / std::max(1.0, tiles - kParameters);  // of few tiles, as of few samples
  const double by_tiles = few * (inverse * scatter * inverse)(0, 0);
  const double by_pixels = normal.squares / static_cast<double>(pixels) * inverse(0, 0);
  return std::sqrt(std::max(by_tiles, by_pixels));
}

}  // namespace

ProfileScale fit_profile_scale(ImageView<const float> image, const SlantedEdgeSpec& spec,
                               const ScaledTransfer& transfer) {
  SlantedEdgeSpec free = spec;
  free.levels.reset();
  const SlantedEdge edge = measured_slanted_edge(image, free);
  const std::vector<FittedPixel> pixels = pixels_of(image, spec, edge);
  const ProfileFamily family(transfer, edge.slant, edge.reach + 2.0);
  Vector p{1.0, 0.0, 0.0, edge.levels.dark, edge.levels.bright - edge.levels.dark, 0.0};
  constexpr int kMostSteps = 40;
  for (int i = 0; i < kMostSteps; ++i) {
    const Normal normal = normal_equations(pixels, family, p);
    const Vector step = normal.matrix.inv(cv::DECOMP_CHOLESKY) * normal.gradient;
    const double scale =
        std::clamp(p[0] + step[0], 1.0 - kWidestProfileScale, 1.0 + kWidestProfileScale);
    const double change = std::abs(scale - p[0]);
    p += step;
    p[0] = scale;
    p[1] = std::clamp(p[1], -1.5, 1.5);  // the tables end 2 px beyond the reach
    if (change < 1e-8 && std::abs(step[1]) < 1e-7) {
      return {.scale = p[0],
              .standard_error = standard_error(normal, pixels.size()),
              .residual = std::sqrt(normal.squares / static_cast<double>(pixels.size())),
              .levels = {p[3], p[3] + p[4]}};
    }
  }
  throw Error(ErrorCode::outside_domain, "no blur of the family fits the edge: it does not settle");
}

}  // namespace fstop
