#include "tests/bench/psf_method.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <utility>

#include "core/optics/bessel.h"
#include "core/optics/defocus_field.h"
#include "core/optics/diffraction.h"
#include "core/optics/lommel.h"
#include "core/optics/quadrature.h"
#include "core/optics/transfer.h"
#include "tests/bench/fft_pupil.h"

namespace fstop {
namespace {

using In = std::span<const double>;
using Out = std::span<double>;

// A rule for (0, 1).
QuadratureRule unit_rule(int count) {
  QuadratureRule rule = gauss_legendre(count);
  for (double& node : rule.nodes) node = 0.5 * (1.0 + node);
  for (double& weight : rule.weights) weight *= 0.5;
  return rule;
}

// Nodes for an integrand that turns through `phase` radians over the interval: half a node for a
// radian of half the interval is the least, the rest buys digits.
int growing_count(double phase) { return 24 + static_cast<int>(0.3 * phase); }

// |G|^2 from its defining integral. J_0 is the larger part of the cost.
void quadrature_profile(const QuadratureRule& rule, double U, In v, Out result) {
  std::vector<std::complex<double>> factors;
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double t = rule.nodes[k];
    factors.push_back(std::polar(rule.weights[k] * t, 0.5 * U * t * t));
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      sum += factors[k] * bessel_j0_j1(v[i] * rule.nodes[k]).j0;
    }
    result[i] = std::norm(sum);
  }
}

// Hopkins's integral by a rule for (0, 1), with the substitution of transfer.h.
void hopkins_profile(const QuadratureRule& rule, double U, In s, Out result) {
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double half = 0.5 * s[i];
    const double range = std::acos(half);
    double sum = 0.0;
    for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
      const double tau = range * rule.nodes[k];
      const double sine = std::sin(tau);
      sum += rule.weights[k] * sine * sine * std::cos(2.0 * half * U * (std::cos(tau) - half));
    }
    result[i] = 4.0 / std::numbers::pi * range * sum;
  }
}

// The point spread that belongs to a model of the OTF, |G|^2 = 1/2 integral from 0 to 2 of
// H(s) J_0(v s) s ds; s = 2 - 2 x^2 smooths the OTF's end.
void model_profile(OtfModel model, double U, In v, Out result) {
  double largest = 0.0;
  for (const double radius : v) largest = std::max(largest, radius);
  const QuadratureRule rule = unit_rule(growing_count(4.0 * (largest + U)));
  std::vector<double> frequencies;
  std::vector<double> factors;
  for (std::size_t k = 0; k < rule.nodes.size(); ++k) {
    const double x = rule.nodes[k];
    const double s = 2.0 * (1.0 - x) * (1.0 + x);
    frequencies.push_back(s);
    factors.push_back(2.0 * rule.weights[k] * x * s * model_otf(model, s, U));
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      sum += factors[k] * bessel_j0_j1(v[i] * frequencies[k]).j0;
    }
    result[i] = sum;
  }
}

PsfMethod lommel(std::string name, bool right) {
  return {.name = std::move(name),
          .profile =
              [right](double U, In v, Out result) {
                for (std::size_t i = 0; i < v.size(); ++i) {
                  const bool u_series = (std::abs(U) <= v[i]) == right;
                  const LommelSide side = u_series ? LommelSide::u_series : LommelSide::v_series;
                  result[i] = std::norm(lommel_field(v[i], U, side));
                }
              },
          .needs_defocus = true};
}

template <typename Evaluate>
PsfMethod with_rule(std::string name, int count, Evaluate evaluate) {
  return {.name = std::move(name),
          .profile = [rule = unit_rule(count), evaluate](double U, In at, Out result) {
            evaluate(rule, U, at, result);
          }};
}

// The disc of rays: its energy 1 = 2 integral of |G|^2 v dv spread evenly over v < |U|.
void disc_profile(double U, In v, Out result) {
  for (std::size_t i = 0; i < v.size(); ++i) result[i] = v[i] < std::abs(U) ? 1.0 / (U * U) : 0.0;
}

PsfMethod otf_model(std::string name, OtfModel model) {
  return {.name = std::move(name), .profile = [model](double U, In s, Out result) {
            for (std::size_t i = 0; i < s.size(); ++i) result[i] = model_otf(model, s[i], U);
          }};
}

PsfMethod intensity_model(std::string name, OtfModel model) {
  return {.name = std::move(name),
          .profile = [model](double U, In v, Out result) { model_profile(model, U, v, result); }};
}

PsfMethod fft_intensity(int samples) {
  const FftPupil pupil(samples);
  return {.name = "FFT " + std::to_string(samples),
          .profile = [pupil](double U, In v, Out result) { pupil.intensities(U, v, result); },
          .nearest = [pupil](double v) { return pupil.nearest_v(v); }};
}

PsfMethod fft_otf(int samples) {
  const FftPupil pupil(samples);
  return {.name = "FFT " + std::to_string(samples),
          .profile = [pupil](double U, In s, Out result) { pupil.otf(U, s, result); },
          .nearest = [pupil](double s) { return pupil.nearest_s(s); }};
}

}  // namespace

std::vector<PsfMethod> intensity_methods() {
  return {{.name = "series",
           .profile = [](double U, In v, Out result) { DefocusField(U).intensities(v, result); }},
          lommel("Lommel", true),
          lommel("Lommel, wrong side", false),
          {.name = "quadrature, growing",
           .profile =
               [](double U, In v, Out result) {
                 const double largest = v.empty() ? 0.0 : *std::ranges::max_element(v);
                 const int count = growing_count(std::abs(U) + largest);
                 quadrature_profile(unit_rule(count), U, v, result);
               }},
          with_rule("quadrature, 24", 24, quadrature_profile),
          with_rule("quadrature, 96", 96, quadrature_profile),
          fft_intensity(128),
          fft_intensity(256),
          fft_intensity(512),
          {.name = "disc", .profile = disc_profile, .needs_defocus = true},
          intensity_model("disc x Airy", OtfModel::disc_times_airy),
          intensity_model("stretched disc", OtfModel::stretched_disc),
          {.name = "Airy", .profile = [](double, In v, Out result) {
             for (std::size_t i = 0; i < v.size(); ++i) result[i] = 0.25 * airy_intensity(v[i]);
           }}};
}

std::vector<PsfMethod> otf_methods() {
  return {{.name = "Hopkins, growing",
           .profile = [](double U, In s, Out result) { DefocusOtf(U).values(s, result); }},
          with_rule("Hopkins, 24", 24, hopkins_profile),
          with_rule("Hopkins, 96", 96, hopkins_profile),
          fft_otf(128),
          fft_otf(256),
          fft_otf(512),
          otf_model("disc", OtfModel::disc),
          otf_model("disc x Airy", OtfModel::disc_times_airy),
          otf_model("stretched disc", OtfModel::stretched_disc),
          otf_model("Airy", OtfModel::airy)};
}

}  // namespace fstop
