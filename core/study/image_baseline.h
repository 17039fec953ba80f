#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/film/image.h"

namespace fstop {

/// Pixels whose mean is tested together, in squares of this side.
inline constexpr int kBaselineBlock = 16;

/// What pictures of one thing look like, told by replicates of different seeds. All images have
/// one size and 3 channels.
struct ImageBaseline {
  int replicates = 0;                         // 2 or more
  Image mean = {};                            // of the replicates
  Image variance = {};                        // of one picture's pixel, s^2 over the replicates
  Image block_variance = {};                  // of one picture's mean over the pixel's block
  std::array<double, 3> total = {};           // the whole picture's mean
  std::array<double, 3> total_variance = {};  // of one picture's
};

/// Collects replicates. Block and total variances are those of the replicates' own block means, not
/// sums over pixels: pixels of one picture may depend on each other.
class BaselineBuilder {
 public:
  /// Throws: Error{outside_domain} for a picture of another size than the first, not of 3 channels,
  ///         or with values that are not finite.
  void add(const Image& picture);
  int replicates() const noexcept { return static_cast<int>(pictures_.size()); }
  /// Throws: Error{outside_domain} for fewer than 2 replicates.
  ImageBaseline finish() const;

 private:
  std::vector<Image> pictures_ = {};
};

/// One scale on which a picture is compared.
struct BaselineLevel {
  std::string name = {};    // "pixel", "block" or "picture"
  int tests = 0;            // that have noise, and so could alarm falsely
  double alarm_rate = 0.0;  // chance of a false alarm, of all of them together
  double threshold = 0.0;   // of |t|
  double largest = 0.0;     // |t|, of all tests
  int alarms = 0;
  int x = 0;  // where the largest is: the pixel, the block's first pixel
  int y = 0;
  int channel = 0;
};

struct BaselineVerdict {
  std::array<BaselineLevel, 3> levels = {};  // pixel, block, picture
  double rmse = 0.0;                         // from the baseline's mean
  double expected_rmse = 0.0;                // of a picture that differs by noise alone
  std::array<double, 3> brightness = {};     // total over the baseline's; 1: unchanged

  bool differs() const;
};

/// Compares a picture with a baseline it has no part in, by t = (x - m)/sqrt(s^2 (1 + 1/n)) with
/// n - 1 degrees of freedom: of every pixel, every block of 16 x 16, and the whole, in every
/// channel that is not a copy of red. Each level has the chance 1 - (1 - alarm_rate)^(1/3) of a
/// false alarm, each of its tests what Sidak's correction leaves.
///
/// A pixel's s^2 is no less than the largest of its block and the eight around it: what is rare, a
/// highlight's edge, few replicates may all miss in one pixel, hardly in 2304. (Of 432 pictures of
/// four bundled scenes none alarmed falsely; by the block's mean 83 did.) Its level thus alarms
/// falsely less often than it says; block and picture are exact where their means are normal. What
/// has no noise at all is compared to rounding, 2^-20 of itself.
/// Throws: Error{outside_domain} for another size, or an alarm_rate not between 0 and 1.
/// Source: prediction interval, Student 1908; Sidak, J. Am. Stat. Assoc. 62, 626 (1967).
BaselineVerdict compared(const Image& picture, const ImageBaseline& baseline, double alarm_rate);

/// t of every pixel, as compared() has it: for looking at.
Image deviation_image(const Image& picture, const ImageBaseline& baseline);

}  // namespace fstop
