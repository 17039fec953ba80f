#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>

#include "api/picture.h"

namespace fstop::server {

/// How far a piece of long work has come: written by the thread that does it, read by any. Holds
/// the newest state alone, so that slow readers miss steps instead of piling them up.
class Progress {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct State {
    double fraction = 0.0;                                      // done, 0 to 1
    double upper_95 = std::numeric_limits<double>::infinity();  // RMSE of the newest preview
    std::shared_ptr<const Image> preview = {};                  // small, linear; null: none yet
    std::uint64_t previews = 0;                                 // shown so far
    std::uint64_t version = 0;                                  // grows with every change
    Time started = {};                                          // epoch: still waiting
    Time shown = {};                                            // the newest preview
  };

  void begin();
  /// `fraction`: 0 to 1; smaller ones than before are passed over.
  void advance(double fraction);
  /// Something else that is told of the work has changed.
  void changed();
  /// Keeps a copy of at most kPreviewSide pixels a side, at most one in kBetweenPreviews.
  void show(const Image& picture, double upper_95);
  /// Takes a preview as it is.
  void keep(Image preview, double upper_95);
  State state() const;

  static constexpr int kPreviewSide = 320;
  static constexpr auto kBetweenPreviews = std::chrono::milliseconds(200);

 private:
  mutable std::mutex mutex_;
  State state_ = {};
  Time shown_ = {};  // of the working thread alone
};

/// `picture` with at most `side` pixels along its longer side; each is the mean of up to 4 x 4
/// samples of the area it stands for. Smaller pictures stay as they are.
Image thumbnail(const Image& picture, int side);

}  // namespace fstop::server
