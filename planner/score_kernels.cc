#include "planner/score_kernels.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VENEER_X86_KERNELS 1
#include <immintrin.h>
#endif

namespace veneer::planner::kernels {
namespace {

#ifdef VENEER_X86_KERNELS

// GCC 12 reports the undefined vectors that its own intrinsics start from.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

// kAtOnce groups share each tap.
#define VENEER_SCORE_512(NAME, TARGET, MULTIPLY_ADD)                                                                \
  template <int kAtOnce>                                                                                            \
  __attribute__((target(TARGET))) inline void NAME##_some(const BlockTaps& taps, const CellRow& row,                \
                                                          const std::uint32_t* groups, std::int32_t limit,          \
                                                          std::int32_t* scores, std::uint16_t* below) {             \
    __m512i sums[kAtOnce];                                                                                          \
    for (int g = 0; g < kAtOnce; ++g) sums[g] = _mm512_loadu_si512(row.offsets + groups[g]);                        \
    const std::int32_t* tap = taps.taps;                                                                            \
    for (int r = 0; r < taps.pairs * taps.rows; ++r) {                                                              \
      const std::int16_t* blocks = row.blocks[r];                                                                   \
      for (int c = 0; c < taps.columns; ++c) {                                                                      \
        const __m512i weight = _mm512_set1_epi32(*tap++);                                                           \
        for (int g = 0; g < kAtOnce; ++g)                                                                           \
          sums[g] = MULTIPLY_ADD(sums[g], weight,                                                                   \
                                 _mm512_loadu_si512(blocks + 2 * (groups[g] + 2 * static_cast<unsigned>(c))));      \
      }                                                                                                             \
    }                                                                                                               \
    for (int g = 0; g < kAtOnce; ++g) {                                                                             \
      _mm512_storeu_si512(scores + g * kGroup, sums[g]);                                                            \
      below[g] = static_cast<std::uint16_t>(_mm512_cmplt_epi32_mask(sums[g], _mm512_set1_epi32(limit)));            \
    }                                                                                                               \
  }                                                                                                                 \
  __attribute__((target(TARGET))) void NAME(const BlockTaps& taps, const CellRow& row, const std::uint32_t* groups, \
                                            std::size_t count, std::int32_t limit, std::int32_t* scores,            \
                                            std::uint16_t* below) {                                                 \
    std::size_t i = 0;                                                                                              \
    for (; i + 4 <= count; i += 4) NAME##_some<4>(taps, row, groups + i, limit, scores + i * kGroup, below + i);    \
    for (; i < count; ++i) NAME##_some<1>(taps, row, groups + i, limit, scores + i * kGroup, below + i);            \
  }

#define VENEER_ADD_PRODUCTS(sum, a, b) _mm512_add_epi32(sum, _mm512_madd_epi16(a, b))
VENEER_SCORE_512(score_groups_vnni, "avx512f,avx512bw,avx512vnni", _mm512_dpwssd_epi32)
VENEER_SCORE_512(score_groups_avx512, "avx512f,avx512bw", VENEER_ADD_PRODUCTS)
#undef VENEER_ADD_PRODUCTS
#undef VENEER_SCORE_512

__attribute__((target("avx2"))) void score_groups_avx2(const BlockTaps& taps, const CellRow& row,
                                                       const std::uint32_t* groups, std::size_t count,
                                                       std::int32_t limit, std::int32_t* scores, std::uint16_t* below) {
  const __m256i bound = _mm256_set1_epi32(limit);
  for (std::size_t i = 0; i < count; ++i) {
    const auto* offsets = reinterpret_cast<const __m256i*>(row.offsets + groups[i]);
    __m256i low = _mm256_loadu_si256(offsets), high = _mm256_loadu_si256(offsets + 1);
    const std::int32_t* tap = taps.taps;
    for (int r = 0; r < taps.pairs * taps.rows; ++r) {
      const std::int16_t* blocks = row.blocks[r] + static_cast<std::size_t>(2) * groups[i];
      for (int c = 0; c < taps.columns; ++c) {
        const __m256i weight = _mm256_set1_epi32(*tap++);
        const auto* at = reinterpret_cast<const __m256i*>(blocks + 4 * c);
        low = _mm256_add_epi32(low, _mm256_madd_epi16(weight, _mm256_loadu_si256(at)));
        high = _mm256_add_epi32(high, _mm256_madd_epi16(weight, _mm256_loadu_si256(at + 1)));
      }
    }
    auto* out = reinterpret_cast<__m256i*>(scores + i * kGroup);
    _mm256_storeu_si256(out, low);
    _mm256_storeu_si256(out + 1, high);
    const int first = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(bound, low)));
    const int second = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpgt_epi32(bound, high)));
    below[i] = static_cast<std::uint16_t>(first | second << 8);
  }
}

#pragma GCC diagnostic pop

ScoreGroups best_score_groups() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512f") != 0)
    return __builtin_cpu_supports("avx512vnni") != 0 ? score_groups_vnni : score_groups_avx512;
  if (__builtin_cpu_supports("avx2") != 0) return score_groups_avx2;
  return score_groups_plain;
}

#else

ScoreGroups best_score_groups() { return score_groups_plain; }

#endif

}  // namespace

void score_groups_plain(const BlockTaps& taps, const CellRow& row, const std::uint32_t* groups, std::size_t count,
                        std::int32_t limit, std::int32_t* scores, std::uint16_t* below) {
  for (std::size_t i = 0; i < count; ++i) {
    std::int32_t* sums = scores + i * kGroup;
    for (int k = 0; k < kGroup; ++k) sums[k] = row.offsets[groups[i] + static_cast<unsigned>(k)];
    const std::int32_t* tap = taps.taps;
    for (int r = 0; r < taps.pairs * taps.rows; ++r) {
      const std::int16_t* blocks = row.blocks[r] + static_cast<std::size_t>(2) * groups[i];
      for (int c = 0; c < taps.columns; ++c, ++tap) {
        const auto first = static_cast<std::int16_t>(*tap), second = static_cast<std::int16_t>(*tap >> 16);
        for (int k = 0; k < kGroup; ++k) sums[k] += first * blocks[4 * c + 2 * k] + second * blocks[4 * c + 2 * k + 1];
      }
    }
    below[i] = 0;
    for (int k = 0; k < kGroup; ++k)
      if (sums[k] < limit) below[i] = static_cast<std::uint16_t>(below[i] | 1U << k);
  }
}

const ScoreGroups score_groups = best_score_groups();

}  // namespace veneer::planner::kernels
