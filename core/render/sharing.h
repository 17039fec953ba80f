#pragma once

#include <optional>
#include <vector>

#include "core/render/defocus_filter.h"

namespace fstop {

/// What is known of a picture's error, and how much of it more samples would mend.
struct Judgement {
  NoiseEstimate noise = {};
  double variance = 0.0;  // of the mean square error; the rest is a filter's bias
};

/// The sharing of samples between pixels: a filter chosen by a pilot's own errors, and the picture
/// that it makes.
class Sharing {
 public:
  /// `blur_px`: blur diameter in pixels of a vergence of 1/metre beside the focus.
  Sharing(double blur_px, const RunControl& run) : blur_px_(blur_px), run_(run) {}

  /// The error of the filtered picture if its bound is below that of `raw`, of the film as it is.
  /// `goal`: mean square error to be reached.
  Judgement judged(const ReplicateFilm& film, const NoiseEstimate& raw, double goal);

  /// Whether the last picture judged is better filtered.
  bool is_better() const noexcept { return is_better_; }
  const FilterCertificate& certificate() const noexcept { return certificate_; }
  /// By block: what filtering leaves of its variance.
  std::vector<float> shares(const BlockGrid& grid) const;
  /// The filtered picture that was judged.
  Image picture() const;
  /// Its error by tiles.
  Image error_tiles() const {
    return fstop::error_tiles(a_, b_, filter_->applied(a_, run_), filter_->applied(b_, run_));
  }
  /// Widest window, pixels.
  int widest() const;

 private:
  DefocusFilter filter_of(const ReplicateFilm& film, const FilterKind& kind) const {
    return {film, a_, b_, blur_px_, kind, run_};
  }
  FilterKind chosen_kind(const ReplicateFilm& film, double goal) const;

  double blur_px_;
  const RunControl& run_;
  Image a_ = {};  // the replicates judged
  Image b_ = {};
  std::optional<FilterKind> kind_ = {};
  std::optional<DefocusFilter> filter_ = {};
  FilterCertificate certificate_ = {};
  bool is_better_ = false;
};

}  // namespace fstop
