#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace fstop {

/// One way to a point spread or an OTF of a round pupil with defocus U, as the charts compare them.
struct PsfMethod {
  std::string name = {};
  /// Fills a profile: |G(v, U)|^2 at every v > 0, or the OTF at every s in (0, 2). All that depends
  /// on U is computed anew in each call: weights, nodes, transforms.
  std::function<void(double defocus, std::span<const double> at, std::span<double> result)> profile;
  /// The point nearest to the argument at which the method answers; the identity for most.
  std::function<double(double at)> nearest = [](double at) { return at; };
  bool needs_defocus = false;  // no answer at U = 0
};

/// The methods for |G|^2 at v: the series of defocus_field.h, Lommel's on either side, quadratures
/// of the defining integral, transforms of sampled pupils, and the simpler models.
std::vector<PsfMethod> intensity_methods();

/// The methods for the OTF at s: Hopkins's integral with a growing and with fixed numbers of nodes,
/// sampled pupils, and the simpler models.
std::vector<PsfMethod> otf_methods();

}  // namespace fstop
