#include "planner/matching/kernels.h"

#include <algorithm>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VENEER_X86_KERNELS 1
#include <immintrin.h>
#endif
namespace veneer::planner::kernels {
namespace {

constexpr int kSumShift = 3;
static_assert(1 << kSumShift == kSumDivisor);
static_assert(kTallestSum * kLargestEntry + kSumDivisor / 2 <= 65535);

#ifdef VENEER_X86_KERNELS

// Lanes hold sums of pairs, at most 2 * kLargestEntry^2 each time, so 28 additions fit 32 bits. Adding the lanes
// up takes as long as a dozen additions, so the limit is looked at only then.
constexpr int kAdditionsPerLane = 28;

// GCC 12 reports the undefined vectors that its own intrinsics start from.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"

__attribute__((target("avx512f,avx512bw"))) std::uint64_t sum_of(__m512i lanes) {
  const __m512i low = _mm512_cvtepu32_epi64(_mm512_castsi512_si256(lanes));
  const __m512i high = _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64(lanes, 1));
  return static_cast<std::uint64_t>(_mm512_reduce_add_epi64(_mm512_add_epi64(low, high)));
}

__attribute__((target("avx512f,avx512bw"))) std::uint64_t window_ssd_avx512(const WindowRows& window,
                                                                            const std::int16_t* data,
                                                                            const std::ptrdiff_t* row_base,
                                                                            std::ptrdiff_t first, std::uint64_t limit) {
  const auto steps = static_cast<int>(window.row_length / kRowStep);
  std::uint64_t total = 0;
  __m512i lanes = _mm512_setzero_si512();
  int additions = 0;
  for (int i = 0; i < window.count; ++i) {
    const std::int16_t* x = data + row_base[window.rows[i]] + first;
    const std::int16_t* y = window.target + static_cast<std::size_t>(i) * window.row_length;
    const std::uint32_t* m = window.mask + static_cast<std::size_t>(i) * static_cast<std::size_t>(steps);
    for (int k = 0; k < steps; ++k) {
      const __m512i d = _mm512_maskz_sub_epi16(m[k], _mm512_loadu_si512(x + k * 32), _mm512_loadu_si512(y + k * 32));
      lanes = _mm512_add_epi32(lanes, _mm512_madd_epi16(d, d));
      if (++additions == kAdditionsPerLane) {
        total += sum_of(lanes);
        if (total > limit) return total;
        lanes = _mm512_setzero_si512(), additions = 0;
      }
    }
  }
  return total + sum_of(lanes);
}

__attribute__((target("avx2"))) std::uint64_t sum_of(__m256i lanes) {
  const __m256i sums = _mm256_add_epi64(_mm256_cvtepu32_epi64(_mm256_castsi256_si128(lanes)),
                                        _mm256_cvtepu32_epi64(_mm256_extracti128_si256(lanes, 1)));
  const __m128i half = _mm_add_epi64(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
  return static_cast<std::uint64_t>(_mm_cvtsi128_si64(half)) + static_cast<std::uint64_t>(_mm_extract_epi64(half, 1));
}

// All bits of 16-bit lane i set where bit i of `bits` is.
__attribute__((target("avx2"))) __m256i spread(std::uint32_t bits) {
  const __m256i place = _mm256_setr_epi16(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, -32768);
  const __m256i all = _mm256_set1_epi16(static_cast<std::int16_t>(bits));
  return _mm256_cmpeq_epi16(_mm256_and_si256(all, place), place);
}

__attribute__((target("avx2"))) std::uint64_t window_ssd_avx2(const WindowRows& window, const std::int16_t* data,
                                                              const std::ptrdiff_t* row_base, std::ptrdiff_t first,
                                                              std::uint64_t limit) {
  const auto steps = static_cast<int>(window.row_length / kRowStep);
  std::uint64_t total = 0;
  __m256i lanes = _mm256_setzero_si256();
  int additions = 0;
  for (int i = 0; i < window.count; ++i) {
    const std::int16_t* x = data + row_base[window.rows[i]] + first;
    const std::int16_t* y = window.target + static_cast<std::size_t>(i) * window.row_length;
    const std::uint32_t* m = window.mask + static_cast<std::size_t>(i) * static_cast<std::size_t>(steps);
    for (int k = 0; k < steps; ++k) {
      for (int half = 0; half < 2; ++half) {
        const auto* from = reinterpret_cast<const __m256i*>(x + k * 32 + half * 16);
        const auto* to = reinterpret_cast<const __m256i*>(y + k * 32 + half * 16);
        __m256i d = _mm256_sub_epi16(_mm256_loadu_si256(from), _mm256_loadu_si256(to));
        const std::uint32_t bits = (m[k] >> (16 * half)) & 0xffffU;
        if (bits != 0xffffU) d = _mm256_and_si256(d, spread(bits));
        lanes = _mm256_add_epi32(lanes, _mm256_madd_epi16(d, d));
      }
      additions += 2;
      if (additions >= kAdditionsPerLane) {
        total += sum_of(lanes);
        if (total > limit) return total;
        lanes = _mm256_setzero_si256(), additions = 0;
      }
    }
  }
  return total + sum_of(lanes);
}

__attribute__((target("avx512f,avx512bw"))) std::uint32_t cell_bounds_avx512(const TapRow* taps, std::size_t count,
                                                                             std::ptrdiff_t first, int shift,
                                                                             std::uint16_t limit,
                                                                             std::uint16_t* bounds) {
  const __m512i most = _mm512_set1_epi16(static_cast<std::int16_t>(65535 >> shift));
  const __m512i limits = _mm512_set1_epi16(static_cast<std::int16_t>(limit));
  const __m128i by = _mm_cvtsi32_si128(shift);
  __m512i sums = _mm512_setzero_si512();
  __mmask32 within = ~0U;
  for (std::size_t begin = 0; begin < count && within != 0; begin += kTapsBetweenChecks) {
    const std::size_t end = std::min(begin + kTapsBetweenChecks, count);
    for (std::size_t t = begin; t < end; ++t) {
      const TapRow& tap = taps[t];
      const __m512i above = _mm512_subs_epu16(_mm512_loadu_si512(tap.lo + first),
                                              _mm512_set1_epi16(static_cast<std::int16_t>(tap.target_hi)));
      const __m512i below = _mm512_subs_epu16(_mm512_set1_epi16(static_cast<std::int16_t>(tap.target_lo)),
                                              _mm512_loadu_si512(tap.hi + first));
      const __m512i d = _mm512_sll_epi16(_mm512_min_epu16(_mm512_or_si512(above, below), most), by);
      sums = _mm512_adds_epu16(sums, _mm512_mulhi_epu16(d, d));
    }
    within = _mm512_cmple_epu16_mask(sums, limits);
  }
  _mm512_storeu_si512(bounds, sums);
  return within;
}

__attribute__((target("avx2"))) std::uint32_t cell_bounds_avx2(const TapRow* taps, std::size_t count,
                                                               std::ptrdiff_t first, int shift, std::uint16_t limit,
                                                               std::uint16_t* bounds) {
  const __m256i most = _mm256_set1_epi16(static_cast<std::int16_t>(65535 >> shift));
  const __m256i limits = _mm256_set1_epi16(static_cast<std::int16_t>(limit));
  const __m128i by = _mm_cvtsi32_si128(shift);
  __m256i sums[2] = {_mm256_setzero_si256(), _mm256_setzero_si256()};
  std::uint32_t within = ~0U;
  for (std::size_t begin = 0; begin < count && within != 0; begin += kTapsBetweenChecks) {
    const std::size_t end = std::min(begin + kTapsBetweenChecks, count);
    for (std::size_t t = begin; t < end; ++t) {
      const TapRow& tap = taps[t];
      const __m256i target_hi = _mm256_set1_epi16(static_cast<std::int16_t>(tap.target_hi));
      const __m256i target_lo = _mm256_set1_epi16(static_cast<std::int16_t>(tap.target_lo));
      for (int half = 0; half < 2; ++half) {
        const auto* lo = reinterpret_cast<const __m256i*>(tap.lo + first + half * 16);
        const auto* hi = reinterpret_cast<const __m256i*>(tap.hi + first + half * 16);
        const __m256i above = _mm256_subs_epu16(_mm256_loadu_si256(lo), target_hi);
        const __m256i below = _mm256_subs_epu16(target_lo, _mm256_loadu_si256(hi));
        const __m256i d = _mm256_sll_epi16(_mm256_min_epu16(_mm256_or_si256(above, below), most), by);
        sums[half] = _mm256_adds_epu16(sums[half], _mm256_mulhi_epu16(d, d));
      }
    }
    // Unsigned comparison: a sum within the limit is its own minimum with it.
    const __m256i low = _mm256_cmpeq_epi16(_mm256_min_epu16(sums[0], limits), sums[0]);
    const __m256i high = _mm256_cmpeq_epi16(_mm256_min_epu16(sums[1], limits), sums[1]);
    const __m256i bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(low, high), 0xd8);
    within = static_cast<std::uint32_t>(_mm256_movemask_epi8(bytes));
  }
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(bounds), sums[0]);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(bounds + 16), sums[1]);
  return within;
}

__attribute__((target("avx512f,avx512bw"))) void row_sums_avx512(const std::int16_t* data,
                                                                 const std::ptrdiff_t* row_base, std::ptrdiff_t first,
                                                                 int height, int groups, int shifts, std::size_t length,
                                                                 std::int16_t* out) {
  const __m512i half = _mm512_set1_epi16(kSumDivisor / 2);
  const std::size_t next = static_cast<std::size_t>(groups) * length;
  for (int g = 0; g < groups; ++g) {
    const std::ptrdiff_t* rows = row_base + static_cast<std::ptrdiff_t>(g) * height;
    for (std::size_t from = 0; from < length; from += kRowStep) {
      const std::int16_t* entries = data + first + from;
      __m512i sums = half;
      for (int r = 0; r < height; ++r) sums = _mm512_add_epi16(sums, _mm512_loadu_si512(entries + rows[r]));
      std::int16_t* to = out + static_cast<std::size_t>(g) * length + from;
      _mm512_storeu_si512(to, _mm512_srli_epi16(sums, kSumShift));
      for (int s = 1; s < shifts; ++s) {
        sums = _mm512_sub_epi16(sums, _mm512_loadu_si512(entries + rows[s - 1]));
        sums = _mm512_add_epi16(sums, _mm512_loadu_si512(entries + rows[s - 1 + height]));
        to += next;
        _mm512_storeu_si512(to, _mm512_srli_epi16(sums, kSumShift));
      }
    }
  }
}

__attribute__((target("avx2"))) void row_sums_avx2(const std::int16_t* data, const std::ptrdiff_t* row_base,
                                                   std::ptrdiff_t first, int height, int groups, int shifts,
                                                   std::size_t length, std::int16_t* out) {
  const __m256i half = _mm256_set1_epi16(kSumDivisor / 2);
  const std::size_t next = static_cast<std::size_t>(groups) * length;
  const auto at = [](const std::int16_t* p) { return reinterpret_cast<const __m256i*>(p); };
  for (int g = 0; g < groups; ++g) {
    const std::ptrdiff_t* rows = row_base + static_cast<std::ptrdiff_t>(g) * height;
    for (std::size_t from = 0; from < length; from += kRowStep / 2) {
      const std::int16_t* entries = data + first + from;
      __m256i sums = half;
      for (int r = 0; r < height; ++r) sums = _mm256_add_epi16(sums, _mm256_loadu_si256(at(entries + rows[r])));
      std::int16_t* to = out + static_cast<std::size_t>(g) * length + from;
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_srli_epi16(sums, kSumShift));
      for (int s = 1; s < shifts; ++s) {
        sums = _mm256_sub_epi16(sums, _mm256_loadu_si256(at(entries + rows[s - 1])));
        sums = _mm256_add_epi16(sums, _mm256_loadu_si256(at(entries + rows[s - 1 + height])));
        to += next;
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_srli_epi16(sums, kSumShift));
      }
    }
  }
}

#pragma GCC diagnostic pop

#endif

std::uint64_t window_ssd_plain(const WindowRows& window, const std::int16_t* data, const std::ptrdiff_t* row_base,
                               std::ptrdiff_t first, std::uint64_t limit) {
  std::uint64_t total = 0;
  for (int i = 0; i < window.count; ++i) {
    const std::int16_t* x = data + row_base[window.rows[i]] + first;
    const std::int16_t* y = window.target + static_cast<std::size_t>(i) * window.row_length;
    const std::uint32_t* m = window.mask + static_cast<std::size_t>(i) * window.row_length / kRowStep;
    for (std::size_t k = 0; k < window.row_length; k += kRowStep) {
      std::uint64_t sum = 0;
      for (std::size_t l = 0; l < kRowStep; ++l) {
        const int d = (m[k / kRowStep] >> l & 1U) != 0 ? x[k + l] - y[k + l] : 0;
        sum += static_cast<std::uint32_t>(d * d);
      }
      total += sum;
    }
    if (total > limit) return total;
  }
  return total;
}

std::uint32_t cell_bounds_plain(const TapRow* taps, std::size_t count, std::ptrdiff_t first, int shift,
                                std::uint16_t limit, std::uint16_t* bounds) {
  const int most = 65535 >> shift;
  std::fill_n(bounds, kCellsAtOnce, std::uint16_t{0});
  std::uint32_t within = ~0U;
  for (std::size_t begin = 0; begin < count && within != 0; begin += kTapsBetweenChecks) {
    const std::size_t end = std::min(begin + kTapsBetweenChecks, count);
    for (std::size_t t = begin; t < end; ++t) {
      const std::uint16_t* lo = taps[t].lo + first;
      const std::uint16_t* hi = taps[t].hi + first;
      for (int i = 0; i < kCellsAtOnce; ++i) {
        const int above = std::max(lo[i] - taps[t].target_hi, 0), below = std::max(taps[t].target_lo - hi[i], 0);
        const auto d = static_cast<std::uint32_t>(std::min(above | below, most)) << shift;
        bounds[i] = static_cast<std::uint16_t>(std::min(bounds[i] + (d * d >> 16), 65535U));
      }
    }
    within = 0;
    for (int i = 0; i < kCellsAtOnce; ++i) within |= static_cast<std::uint32_t>(bounds[i] <= limit) << i;
  }
  return within;
}

void row_sums_plain(const std::int16_t* data, const std::ptrdiff_t* row_base, std::ptrdiff_t first, int height,
                    int groups, int shifts, std::size_t length, std::int16_t* out) {
  for (int s = 0; s < shifts; ++s) {
    for (int g = 0; g < groups; ++g) {
      for (std::size_t i = 0; i < length; ++i, ++out) {
        int sum = kSumDivisor / 2;
        for (int r = 0; r < height; ++r)
          sum += data[row_base[g * height + s + r] + first + static_cast<std::ptrdiff_t>(i)];
        *out = static_cast<std::int16_t>(sum / kSumDivisor);
      }
    }
  }
}

std::vector<Versions> runnable_versions() {
  std::vector<Versions> out{{"plain", window_ssd_plain, row_sums_plain, cell_bounds_plain}};
#ifdef VENEER_X86_KERNELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") != 0) out.push_back({"avx2", window_ssd_avx2, row_sums_avx2, cell_bounds_avx2});
  if (__builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512f") != 0)
    out.push_back({"avx512", window_ssd_avx512, row_sums_avx512, cell_bounds_avx512});
#endif
  return out;
}

}  // namespace

std::span<const Versions> versions() {
  static const std::vector<Versions> runnable = runnable_versions();
  return runnable;
}

const WindowSsd window_ssd = versions().back().window_ssd;
const RowSums row_sums = versions().back().row_sums;
const CellBounds cell_bounds = versions().back().cell_bounds;

}  // namespace veneer::planner::kernels
