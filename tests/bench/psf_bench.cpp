// Times of the point-spread kernels, on one core: evaluations per second of G(v, U), milliseconds
// for a 512-point radial profile, and its relatives. Each figure is the minimum and the median of
// several runs, in processor time of this thread.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "core/geometry.h"
#include "core/optics/circular_psf.h"
#include "core/optics/defocus_field.h"
#include "core/optics/oblique_pinhole.h"
#include "core/optics/polygon_psf.h"
#include "core/optics/rayleigh_sommerfeld.h"
#include "core/optics/spectrum.h"
#include "core/optics/transfer.h"
#include "tests/bench/thread_timer.h"

namespace {

using namespace fstop;

constexpr int kRuns = 21;

// Kept where the compiler cannot see that nobody reads it.
volatile double g_sink = 0.0;

Timing seconds_of(const std::function<double()>& work) {
  return fstop::seconds_of([&] { g_sink = g_sink + work(); }, kRuns);
}

void print_rate(const char* what, double largest_U, double largest_v, double count, Timing time) {
  std::printf("%-34s |U| <= %6g, v <= %6g: %6.2f million/s (median %6.2f)\n", what, largest_U,
              largest_v, count / time.minimum / 1e6, count / time.median / 1e6);
}

void print_milliseconds(const char* what, double parameter, Timing time) {
  std::printf("%-50s %8g: %9.4f ms (median %9.4f)\n", what, parameter, time.minimum * 1e3,
              time.median * 1e3);
}

void bench_field() {
  constexpr int kCount = 8192;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const double largest_U : {5.0, 50.0, 1000.0}) {
    for (const double largest_v : {20.0, 100.0, 2000.0}) {
      std::vector<double> U;
      std::vector<double> v;
      for (int i = 0; i < kCount; ++i) {
        U.push_back(largest_U * (2.0 * uniform(random) - 1.0));
        v.push_back(largest_v * uniform(random));
      }
      print_rate("G, new U every time", largest_U, largest_v, kCount, seconds_of([&] {
                   double sum = 0.0;
                   for (std::size_t i = 0; i < kCount; ++i) sum += defocus_field(v[i], U[i]).real();
                   return sum;
                 }));
      const DefocusField field(largest_U);
      print_rate("G, one U, single v", largest_U, largest_v, kCount, seconds_of([&] {
                   double sum = 0.0;
                   for (const double radius : v) sum += field(radius).real();
                   return sum;
                 }));
      std::ranges::sort(v);
      std::vector<double> result(v.size());
      print_rate("|G|^2, one U, sorted v in batches", largest_U, largest_v, kCount, seconds_of([&] {
                   field.intensities(v, result);
                   return result.front();
                 }));
    }
  }
}

void bench_profiles() {
  std::vector<double> v(512);
  std::vector<double> result(512);
  for (const double U : {0.0, 6.283, 50.0, 209.4, 500.0, 1000.0}) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] = static_cast<double>(i) / 511.0 * (1.5 * U + 30.0);
    }
    print_milliseconds("512-point profile of |G|^2, weights included, U", U, seconds_of([&] {
                         const DefocusField field(U);
                         field.intensities(v, result);
                         return result.front();
                       }));
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = static_cast<double>(i) / 511.0 * 2.0;
    const DefocusOtf otf(U);
    print_milliseconds("512 frequencies of the OTF, U", U, seconds_of([&] {
                         otf.values(v, result);
                         return result.front();
                       }));
  }
  std::vector<double> radii(512);
  for (std::size_t i = 0; i < radii.size(); ++i) radii[i] = static_cast<double>(i) * 3e-6;
  for (const double mm : {0.07, 0.35, 2.0}) {
    const CircularPupil hole = pinhole_pupil(Length::si(mm / 1e3), 50.0_mm);
    print_milliseconds(
        "512-point RGB profile to 0.001, pinhole mm", mm, seconds_of([&] {
          return polychromatic_profile(hole, SpectralBands::sensor, radii, 1e-3).density[0][0];
        }));
    const CircularPsf psf(hole, 550.0_nm);
    print_milliseconds("radius of 80 % of the light, pinhole mm", mm,
                       seconds_of([&] { return psf.encircled_radius(0.8).si(); }));
  }
}

void bench_others() {
  const CircularPupil hole = pinhole_pupil(0.35_mm, 50.0_mm);
  const ObliquePinholePsf oblique(hole, 550.0_nm, 0.35, 0.5_mm);
  print_milliseconds("oblique pinhole, 1000 points, degrees", 20.0, seconds_of([&] {
                       double sum = 0.0;
                       for (int i = 0; i < 1000; ++i) {
                         sum += oblique.density(Length::si(i * 4e-7), 0.1_mm).si();
                       }
                       return sum;
                     }));
  const PolygonPupil pupil({.blades = 7, .rotation = 0.1});
  for (const double U : {0.0, 10.0, 100.0}) {
    print_milliseconds("seven blades, 100 points, U", U, seconds_of([&] {
                         double sum = 0.0;
                         for (int i = 0; i < 100; ++i) sum += pupil.intensity({i * 0.5, 3.0}, U);
                         return sum;
                       }));
  }
  const RoundHole round{.radius = 0.175_mm, .distance = 50.0_mm, .wavelength = 550.0_nm};
  print_milliseconds("Rayleigh-Sommerfeld, 100 points, radius/mm", 0.175, seconds_of([&] {
                       double sum = 0.0;
                       for (int i = 0; i < 100; ++i) {
                         sum += rayleigh_sommerfeld_intensity(round, Length::si(i * 4e-6)).value;
                       }
                       return sum;
                     }));
}

}  // namespace

int main() {
  bench_field();
  bench_profiles();
  bench_others();
  return 0;
}
