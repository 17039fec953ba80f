#pragma once

#include <map>
#include <vector>

namespace fstop {

/// The truth that the point-spread methods are measured against: quadratures in long double with
/// twice the nodes that double precision asks for. Shares no expansion with core/optics: Bessel's
/// function is the C library's, the OTF is integrated across the overlap, not along it.
class PsfReference {
 public:
  /// |G(v, U)|^2 of defocus_field.h from G = integral of J_0(vt) exp(iUt^2/2) t dt over (0, 1);
  /// v >= 0. To 1e-16 for |U| <= 1000, v <= 3000.
  double intensity(double v, double defocus);
  /// The OTF of transfer.h, chord by chord of the pupil's overlap:
  ///
  ///     H(s) = 4/pi integral from 0 to acos(s/2) of sin(U s h)/(U s) cos(phi) dphi,
  ///     h = cos(phi) - s/2
  ///
  /// 0 from s = 2 on. To 1e-16 for |U| <= 1000.
  double otf(double s, double defocus);
  /// How many times the nodes named above; 1 unless a check of the reference itself asks for more.
  void set_refinement(int refinement) { refinement_ = refinement; }

 private:
  struct Rule {
    std::vector<long double> nodes = {};  // in (0, 1)
    std::vector<long double> weights = {};
  };
  // Counts are rounded up to multiples of 32, so that few rules serve many arguments.
  const Rule& rule(double least_count);

  std::map<int, Rule> rules_ = {};
  int refinement_ = 1;
};

}  // namespace fstop
