#include "core/build_stop.h"

#include <utility>

#include "core/error.h"

namespace fstop {
namespace {

thread_local const BuildStop* newest = nullptr;

}  // namespace

BuildStop::BuildStop(std::stop_token stop)
    : stop_(std::move(stop)), outer_(std::exchange(newest, this)) {}

BuildStop::~BuildStop() { newest = outer_; }

std::stop_token BuildStop::current() {
  return newest == nullptr ? std::stop_token() : newest->stop_;
}

void BuildStop::throw_if_requested() {
  if (newest != nullptr && newest->stop_.stop_requested())
    throw Error(ErrorCode::cancelled, "the scene was given up before it was built");
}

}  // namespace fstop
