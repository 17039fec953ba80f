#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/film/image.h"
#include "core/geometry.h"
#include "core/optics/quadrature.h"

/// Pictures of a straight edge, made by quadrature from a profile: nothing here is shared with
/// the code that measures them.
namespace fstop::oracle {

/// An edge through `through` (raster px), its bright side `angle` radians from +x towards +y.
struct EdgePicture {
  int width = 128;
  int height = 128;
  Vec2 through = {64.17, 63.71};
  double angle = 0.0;
  double dark = 0.1;
  double bright = 0.8;
  double noise = 0.0;  // standard deviation, of the contrast
  unsigned seed = 1;
};

/// The mean over a pixel's square of a profile of the distance, the square's centre at `distance`.
/// The square's projection on the normal is a trapezoid; three pieces of 4 panels of 16 nodes.
inline double pixel_mean(const std::function<double(double)>& profile, double distance,
                         double angle) {
  const double a = 0.5 * std::abs(std::cos(angle));
  const double b = 0.5 * std::abs(std::sin(angle));
  const double flat = std::abs(a - b);
  const double end = a + b;
  const double height = 1.0 / std::max(2.0 * a, 2.0 * b);
  const auto weighted = [&](double w) {
    const double share = std::abs(w) <= flat ? 1.0 : (end - std::abs(w)) / (end - flat);
    return height * share * profile(distance + w);
  };
  double sum = 0.0;
  constexpr int kPanels = 4;
  const double ends[] = {-end, -flat, flat, end};
  for (int piece = 0; piece < 3; ++piece) {
    const double width = (ends[piece + 1] - ends[piece]) / kPanels;
    if (width <= 0.0) continue;
    for (int i = 0; i < kPanels; ++i) {
      sum += gauss16(ends[piece] + i * width, ends[piece] + (i + 1) * width, weighted);
    }
  }
  return sum;
}

/// `profile` from 0 to 1 over the signed distance in px; rows of one channel.
inline Image edge_picture(const EdgePicture& edge, const std::function<double(double)>& profile) {
  Image image(edge.width, edge.height, 1);
  std::mt19937 random(edge.seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int y = 0; y < edge.height; ++y) {
    for (int x = 0; x < edge.width; ++x) {
      const double distance = (x + 0.5 - edge.through.x) * std::cos(edge.angle) +
                              (y + 0.5 - edge.through.y) * std::sin(edge.angle);
      double value = pixel_mean(profile, distance, edge.angle);
      if (edge.noise > 0.0) value += edge.noise * noise(random);
      *image.at(x, y) = static_cast<float>(edge.dark + (edge.bright - edge.dark) * value);
    }
  }
  return image;
}

/// A step blurred by a uniform disc of `radius` px: 1/2 + [t sqrt(1 - t^2) + asin t]/pi.
inline std::function<double(double)> disc_profile(double radius) {
  return [radius](double x) {
    const double t = std::clamp(x / radius, -1.0, 1.0);
    return 0.5 + (t * std::sqrt(1.0 - t * t) + std::asin(t)) / std::numbers::pi;
  };
}

inline double sinc(double x) {
  return x == 0.0 ? 1.0 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

/// 2 J_1(2 pi nu R)/(2 pi nu R) times the pixel's square seen along the edge's normal.
inline double disc_pixel_otf(double frequency, double radius, double angle) {
  const double x = 2.0 * std::numbers::pi * frequency * radius;
  const double disc = x == 0.0 ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
  return disc * sinc(frequency * std::cos(angle)) * sinc(frequency * std::sin(angle));
}

/// The lowest frequency at which `otf` is `level`; it must stay below for 0.002 cycles/px at least.
inline double first_frequency(const std::function<double(double)>& otf, double level) {
  double low = 0.0;
  while (otf(low + 2e-3) > level) low += 2e-3;
  double high = low + 2e-3;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (otf(middle) > level ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace fstop::oracle
