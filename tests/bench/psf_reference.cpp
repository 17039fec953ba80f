#include "tests/bench/psf_reference.h"

#include <algorithm>
#include <cmath>
#include <math.h>  // j0l, which <cmath> does not name
#include <numbers>

#include "core/optics/quadrature.h"

namespace fstop {
namespace {

struct Legendre {
  long double value = 0.0L;
  long double slope = 0.0L;
};

Legendre legendre(int degree, long double x) {
  long double previous = 1.0L;
  long double value = x;
  for (int k = 2; k <= degree; ++k) {
    const auto order = static_cast<long double>(k);
    const long double next =
        ((2.0L * order - 1.0L) * x * value - (order - 1.0L) * previous) / order;
    previous = value;
    value = next;
  }
  return {value,
          static_cast<long double>(degree) * (previous - x * value) / ((1.0L - x) * (1.0L + x))};
}

}  // namespace

const PsfReference::Rule& PsfReference::rule(double least_count) {
  const int count = 32 * static_cast<int>(std::ceil(least_count * refinement_ / 32.0));
  Rule& rule = rules_[count];
  if (!rule.nodes.empty()) return rule;
  for (const double guess : gauss_legendre(count).nodes) {
    // One step of Newton's doubles the guess's 16 digits.
    long double x = guess;
    const Legendre p = legendre(count, x);
    x -= p.value / p.slope;
    const long double slope = legendre(count, x).slope;
    rule.nodes.push_back(0.5L * (1.0L + x));
    rule.weights.push_back(1.0L / ((1.0L - x) * (1.0L + x) * slope * slope));
  }
  return rule;
}

double PsfReference::intensity(double v, double defocus) {
  const Rule& nodes = rule(64.0 + 0.6 * (std::abs(defocus) + v));
  long double real = 0.0L;
  long double imaginary = 0.0L;
  for (std::size_t i = 0; i < nodes.nodes.size(); ++i) {
    const long double t = nodes.nodes[i];
    const long double amplitude = nodes.weights[i] * t * ::j0l(v * t);
    const long double phase = 0.5L * defocus * t * t;
    real += amplitude * std::cos(phase);
    imaginary += amplitude * std::sin(phase);
  }
  return static_cast<double>(real * real + imaginary * imaginary);
}

double PsfReference::otf(double s, double defocus) {
  if (s >= 2.0) return 0.0;
  const long double half = 0.5L * s;
  const long double range = std::acos(half);
  const long double scale = static_cast<long double>(defocus) * s;
  const Rule& nodes = rule(64.0 + 0.6 * std::abs(defocus));
  long double sum = 0.0L;
  for (std::size_t i = 0; i < nodes.nodes.size(); ++i) {
    const long double cosine = std::cos(range * nodes.nodes[i]);
    const long double height = std::max(0.0L, cosine - half);
    const long double phase = scale * height;
    const long double chord = std::abs(phase) < 1e-9L ? height : height * (std::sin(phase) / phase);
    sum += nodes.weights[i] * chord * cosine;
  }
  return static_cast<double>(4.0L / std::numbers::pi_v<long double> * range * sum);
}

}  // namespace fstop
