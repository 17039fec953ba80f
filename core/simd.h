#pragma once

namespace fstop {

/// Loops over the lanes of a packet are plain loops, compiled twice: for the baseline
/// instruction set (AVX2) and, in functions marked so, for AVX-512. Both do the same operations
/// in the same order, without contraction, so their results are equal to the bit.
#define FSTOP_AVX512 \
  [[gnu::target("avx512f,avx512bw,avx512cd,avx512dq,avx512vl,prefer-vector-width=512")]]
/// A loop's one source, to be called by a marked and an unmarked function.
#define FSTOP_KERNEL [[gnu::always_inline]] inline

/// Whether this processor runs the functions marked FSTOP_AVX512. The environment's
/// FSTOP_SIMD=avx2 says no.
bool has_avx512() noexcept;

}  // namespace fstop
