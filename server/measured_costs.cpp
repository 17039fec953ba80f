#include "server/measured_costs.h"

#include <vector>

namespace fstop::server {
namespace {

struct Row {
  double pixels, error, samples, f_number, diffraction, blur, transform;
  int is_pinhole, is_forced, is_wave;
  double log_samples, log_nanoseconds;
  unsigned long long scene;
};

constexpr Row kRows[] = {
#include "server/measured_costs.inc"
};

std::vector<CostObservation> observations() {
  const std::uint64_t usual = cost_kind(SimulationSpec{});
  std::vector<CostObservation> all;
  for (const Row& row : kRows) {
    all.push_back({.asked = {.pixels = row.pixels,
                             .error = row.error,
                             .samples = row.samples,
                             .f_number = row.f_number,
                             .diffraction = row.diffraction,
                             .blur = row.blur,
                             .transform = row.transform,
                             .is_pinhole = row.is_pinhole != 0,
                             .is_forced = row.is_forced != 0,
                             .kind = usual,
                             .scene = row.scene},
                   .is_wave = row.is_wave != 0,
                   .log_samples = row.log_samples,
                   .log_nanoseconds = row.log_nanoseconds});
  }
  return all;
}

}  // namespace

std::span<const CostObservation> measured_costs() {
  static const std::vector<CostObservation> all = observations();
  return all;
}

}  // namespace fstop::server
