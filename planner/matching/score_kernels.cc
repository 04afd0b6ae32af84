#include "planner/matching/score_kernels.h"

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

constexpr int kBlocks = 6;  // a window, across: what nearly all have

// kAtOnce groups share each tap.
#define VENEER_SCORE_512(NAME, TARGET, MULTIPLY_ADD)                                                                \
  __attribute__((target(TARGET), always_inline)) inline __m512i NAME##_six(__m512i sum, const std::int32_t* tap,    \
                                                                           __m512i here, __m512i next) {            \
    sum = MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[0]), here);                                                       \
    sum = MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[1]), _mm512_alignr_epi32(next, here, 2));                         \
    sum = MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[2]), _mm512_alignr_epi32(next, here, 4));                         \
    sum = MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[3]), _mm512_alignr_epi32(next, here, 6));                         \
    sum = MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[4]), _mm512_alignr_epi32(next, here, 8));                         \
    return MULTIPLY_ADD(sum, _mm512_set1_epi32(tap[5]), _mm512_alignr_epi32(next, here, 10));                       \
  }                                                                                                                 \
  template <int kAtOnce>                                                                                            \
  __attribute__((target(TARGET))) inline void NAME##_some(const BlockTaps& taps, const CellRow& row,                \
                                                          const std::uint32_t* groups, std::int32_t limit,          \
                                                          std::int32_t* scores, std::uint16_t* below) {             \
    __m512i sums[kAtOnce];                                                                                          \
    for (int g = 0; g < kAtOnce; ++g) sums[g] = _mm512_loadu_si512(row.offsets + groups[g]);                        \
    const std::int32_t* tap = taps.taps;                                                                            \
    /* Windows of kBlocks blocks: shifted registers instead of overlapping loads. */                                \
    const bool usual = taps.columns == kBlocks;                                                                     \
    for (int r = 0; usual && r < taps.pairs * taps.rows; ++r, tap += kBlocks) {                                     \
      for (int g = 0; g < kAtOnce; ++g) {                                                                           \
        const std::int16_t* blocks = row.blocks[r] + static_cast<std::size_t>(2) * groups[g];                       \
        sums[g] = NAME##_six(sums[g], tap, _mm512_loadu_si512(blocks), _mm512_loadu_si512(blocks + 2 * kGroup));    \
      }                                                                                                             \
    }                                                                                                               \
    for (int r = 0; !usual && r < taps.pairs * taps.rows; ++r) {                                                    \
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
  /* The same for four groups side by side. */                                                                      \
  __attribute__((target(TARGET))) inline void NAME##_row(const BlockTaps& taps, const CellRow& row,                 \
                                                         std::uint32_t group, std::int32_t limit,                   \
                                                         std::int32_t* scores, std::uint16_t* below) {              \
    __m512i sums[4];                                                                                                \
    for (int g = 0; g < 4; ++g) sums[g] = _mm512_loadu_si512(row.offsets + group + g * kGroup);                     \
    const std::int32_t* tap = taps.taps;                                                                            \
    for (int r = 0; r < taps.pairs * taps.rows; ++r, tap += kBlocks) {                                              \
      const std::int16_t* blocks = row.blocks[r] + static_cast<std::size_t>(2) * group;                             \
      __m512i cells[5];                                                                                             \
      for (int g = 0; g < 5; ++g) cells[g] = _mm512_loadu_si512(blocks + 2 * g * kGroup);                           \
      for (int g = 0; g < 4; ++g) {                                                                                 \
        sums[g] = NAME##_six(sums[g], tap, cells[g], cells[g + 1]);                                                 \
      }                                                                                                             \
    }                                                                                                               \
    for (int g = 0; g < 4; ++g) {                                                                                   \
      _mm512_storeu_si512(scores + g * kGroup, sums[g]);                                                            \
      below[g] = static_cast<std::uint16_t>(_mm512_cmplt_epi32_mask(sums[g], _mm512_set1_epi32(limit)));            \
    }                                                                                                               \
  }                                                                                                                 \
  __attribute__((target(TARGET))) void NAME(const BlockTaps& taps, const CellRow& row, const std::uint32_t* groups, \
                                            std::size_t count, std::int32_t limit, std::int32_t* scores,            \
                                            std::uint16_t* below) {                                                 \
    std::size_t i = 0;                                                                                              \
    for (; i + 4 <= count; i += 4) {                                                                                \
      if (taps.columns == kBlocks && groups[i + 3] == groups[i] + 3 * kGroup)                                       \
        NAME##_row(taps, row, groups[i], limit, scores + i * kGroup, below + i);                                    \
      else                                                                                                          \
        NAME##_some<4>(taps, row, groups + i, limit, scores + i * kGroup, below + i);                               \
    }                                                                                                               \
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

std::vector<ScoreVersion> score_versions() {
  std::vector<ScoreVersion> out{{"plain", score_groups_plain}};
#ifdef VENEER_X86_KERNELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") != 0) out.push_back({"avx2", score_groups_avx2});
  if (__builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512f") != 0) {
    out.push_back({"avx512", score_groups_avx512});
    if (__builtin_cpu_supports("avx512vnni") != 0) out.push_back({"vnni", score_groups_vnni});
  }
#endif
  return out;
}

const ScoreGroups score_groups = score_versions().back().run;

}  // namespace veneer::planner::kernels
