#pragma once

#include <span>
#include <vector>

namespace fstop {

/// The defocuses U that point spreads are computed for; light between two of them is shared out
/// between both. Light too far off, where rays say enough, belongs to none.
class DepthNodes {
 public:
  /// Where a defocus lies: node `first` and the next, which has the weight `second`; first < 0:
  /// beyond the nodes.
  struct Place {
    int first = -1;
    float second = 0.0F;
  };

  /// Nodes for the defocuses in `values` (any order, infinities are left out): one alone for values
  /// that lie close together; over a range as many that linear interpolation of the OTF errs by at
  /// most `tolerance`:
  ///
  ///     step of U = sqrt(tolerance/0.01) max(1.5, 0.19 |U|^(3/4))
  ///
  /// At most `most` nodes, the least defocused, and none beyond `largest`; one at least, 0 if need
  /// be.
  /// Source: |d2H/dU2| <= 0.036 over all s and U, and falls as 2.3 |U|^(-3/2): Hopkins' integral.
  DepthNodes(std::vector<double> values, double tolerance, int most, double largest);

  std::span<const double> defocuses() const noexcept { return nodes_; }
  /// Whether light lies between nodes.
  bool interpolates() const noexcept;
  /// The least |U| beyond which light belongs to no node.
  double reach() const noexcept;
  /// Values outside the nodes go to the nearest, except those that lie beyond nodes left out.
  Place place(double defocus) const noexcept;
  Place nearest(double defocus) const noexcept;

 private:
  std::vector<double> nodes_;  // ascending
  std::vector<char> joined_;   // whether light between node i and i + 1 is shared out
  double step_scale_;
  double least_;  // beyond which nodes were left out
  double greatest_;
};

/// The step of U that keeps the interpolated OTF within 0.01.
double defocus_step(double defocus) noexcept;

/// How many such steps lead from 0 to U; the sign is that of U.
double defocus_steps(double defocus) noexcept;
/// The inverse of defocus_steps.
double defocus_after(double steps) noexcept;

}  // namespace fstop
