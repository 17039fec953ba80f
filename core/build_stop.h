#pragma once

#include <stop_token>

namespace fstop {

/// While it lives, scenes that the same thread builds (RayScene) are given up once `stop` is
/// requested: they throw Error{cancelled}. Of several the newest counts.
class BuildStop {
 public:
  explicit BuildStop(std::stop_token stop);
  ~BuildStop();
  BuildStop(const BuildStop&) = delete;
  BuildStop& operator=(const BuildStop&) = delete;

  /// What counts on this thread now; without one, a token that never stops.
  static std::stop_token current();
  /// Throws: Error{cancelled}.
  static void throw_if_requested();

 private:
  std::stop_token stop_;
  const BuildStop* outer_;
};

}  // namespace fstop
