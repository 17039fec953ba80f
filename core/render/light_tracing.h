#pragma once

#include <cstdint>
#include <vector>

#include "core/film/replicate_film.h"
#include "core/render/block_tracer.h"
#include "core/render/bokeh_splatting.h"
#include "core/render/light_aim.h"

namespace fstop {

/// What light is carried from, through and to.
struct LightCarrier {
  const SampleSource& rays;  // scene, camera, pupil, exposure, shutter, motion of the camera
  std::vector<LightAim> aims = {};
  std::uint32_t seed = 0;
};

/// What a carrier brought to the film.
struct CarriedLight {
  double mse = 0.0;  // of the two replicates' mean, values clipped to [0,1]
  double rms = 0.0;  // of the light itself, likewise
  std::uint64_t rays = 0;
  std::uint64_t paths = 0;  // both replicates together
};

/// Carries light of lamps forward, by mirrors and glass, to surfaces that scatter it, and from each
/// such point through the pupil onto the film (light tracing; Arvo 1986, Dutre & Willems 1994):
///
///     lamp -> (mirrored | refracted)+ -> scattered at P -> pupil L -> film
///
/// with further turns behind P, of which every scattering one sends light to the film, too. It is
/// all light that camera paths cannot find, and none that they do: theirs reach lamps by straight
/// shadow rays, which only thin sheets let pass.
///
/// `count` paths, a power of two, for each aim: directions fill the cone about the aim's object, or
/// a quad itself.
/// A path's weight w is the irradiance times area that it stands for, in the units of intensity
/// ("no hidden factors of pi"): intensity f_angular d^2 f_radial(d) / (density * count), d the
/// length of the way to the first scattering surface, and intensity times area for directional
/// lights. The pixel where L's ray to P falls receives w * diffuse * dq/dA, dq/dA as in
/// EmitterSampler. Where light is refracted w goes with the square of the indices' ratio, as
/// radiance does not change along rays in this model: it is what camera paths see, seen from the
/// other end.
///
/// Adds to `light`; keyed by (seed, replicate, aim, index): bytes do not depend on the number of
/// threads. Returns the number of rays. Throws: Error{cancelled}.
std::uint64_t carry_light(const LightCarrier& carrier, std::uint32_t replicate, std::uint32_t count,
                          SplatImage& light, const RunControl& run);

/// The same into both replicates of `film`, beside what they have, by as many paths as bring the
/// mean square error below `goal_mse`, at most `most_paths` in all.
CarriedLight carry_light(const LightCarrier& carrier, double goal_mse, double most_paths,
                         ReplicateFilm& film, const RunControl& run);

}  // namespace fstop
