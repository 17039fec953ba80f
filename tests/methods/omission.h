#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace fstop {

/// One camera before one scene, an effect in the picture and left out of it.
struct OmissionTrial {
  std::string effect = {};
  std::uint32_t seed = 0;
  double strength = 0.0;  // of the effect: what is swept around the threshold
  const char* unit = "";  // of `strength`
  bool modelled = false;  // by the report of the picture that may leave it out
  double bound = 0.0;     // by the same report
  double change = 0.0;    // RMSE between both, values clipped to [0,1], noise taken out
  double scatter = 0.0;   // of `change`, from noise

  bool holds() const { return change <= bound + 2.0 * scatter; }
};

/// Cameras around the threshold where each effect starts to matter; `seed` draws the case.
///
/// defocus: `pinhole` against lens sampling, blur of 0.05 to 4 px. diffraction: lens sampling
/// against `wave`, Q of 0.01 to 1, the bound joined with wave's own. motion and area light: `auto`
/// at max_error 0.02 against lens sampling at 1e-5, paths of 0.02 to 5 px and lights of 0.001 to 1
/// of their height. reflection: a camera inside a mirror ball against the series' closed form,
/// reflection of 0.3 to 0.995. texture detail: lookups at max_error 0.05 against 1e-5, texels of
/// 0.1 to 2 px. falloff: `automatic` against `on`, 24 to 400 mm.
OmissionTrial defocus_omitted(std::uint32_t seed);
OmissionTrial diffraction_omitted(std::uint32_t seed);
OmissionTrial motion_omitted(std::uint32_t seed);
OmissionTrial area_light_omitted(std::uint32_t seed);
OmissionTrial reflection_omitted(std::uint32_t seed);
OmissionTrial texture_detail_omitted(std::uint32_t seed);
OmissionTrial falloff_omitted(std::uint32_t seed);

void print_omissions(std::ostream& out, const std::vector<OmissionTrial>& trials);

}  // namespace fstop
