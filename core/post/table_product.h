#pragma once

#include "core/post/polar_table.h"
#include "core/post/spectral_plane.h"
#include "core/post/wave_transfer.h"

namespace fstop {

/// Frequencies between neighbouring columns and rows of a spectrum, cycles per metre.
struct FrequencySteps {
  double column = 0.0;
  double row = 0.0;
};

/// cos or sin of 2 m psi, psi the frequency's azimuth.
struct AzimuthHarmonic {
  int order = 1;  // m
  bool sine = false;
};

/// Adds to `sum` the spectrum `sharp` times a table's value at every frequency.
void add_radial(const RadialTable& table, const FrequencySteps& steps, const SpectralPlane& sharp,
                SpectralPlane& sum);
void add_polar(const PolarTable& table, const FrequencySteps& steps, const SpectralPlane& sharp,
               SpectralPlane& sum);
void add_harmonic(const RadialTable& table, const AzimuthHarmonic& harmonic,
                  const FrequencySteps& steps, const SpectralPlane& sharp, SpectralPlane& sum);

/// The transfer jinc(2 pi nu R) of a disc of radius R (metres), up to a frequency; linear
/// interpolation errs by 3e-5.
RadialTable disc_table(double radius, double highest_frequency);

}  // namespace fstop
