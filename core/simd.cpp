#include "core/simd.h"

#include <cstdlib>
#include <string_view>

namespace fstop {
namespace {

bool detected() noexcept {
  if (const char* asked = std::getenv("FSTOP_SIMD"); asked != nullptr) {
    if (std::string_view(asked) == "avx2") return false;
  }
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}

}  // namespace

bool has_avx512() noexcept {
  static const bool there = detected();
  return there;
}

}  // namespace fstop
