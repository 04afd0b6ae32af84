#include "planner/kernels.h"

#include <algorithm>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VENEER_X86_KERNELS 1
#include <immintrin.h>
#endif
// Resolvers of function clones run before the sanitizers' runtime is up.
#if defined(VENEER_X86_KERNELS) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define VENEER_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VENEER_CLONES
#endif

namespace veneer::planner::kernels {
namespace {

constexpr int kRowsBetweenChecks = 4;

#ifdef VENEER_X86_KERNELS

// Lanes hold sums of pairs, below 2 * (kTallestSum * kLargestEntry)^2 each time, so some 30 additions fit 32 bits.
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
        lanes = _mm512_setzero_si512(), additions = 0;
      }
    }
    if (i % kRowsBetweenChecks == kRowsBetweenChecks - 1) {
      total += sum_of(lanes);
      lanes = _mm512_setzero_si512(), additions = 0;
      if (total > limit) return total;
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
        lanes = _mm256_setzero_si256(), additions = 0;
      }
    }
    if (i % kRowsBetweenChecks == kRowsBetweenChecks - 1) {
      total += sum_of(lanes);
      lanes = _mm256_setzero_si256(), additions = 0;
      if (total > limit) return total;
    }
  }
  return total + sum_of(lanes);
}

#pragma GCC diagnostic pop

WindowSsd best_window_ssd() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512f") != 0) return window_ssd_avx512;
  if (__builtin_cpu_supports("avx2") != 0) return window_ssd_avx2;
  return window_ssd_plain;
}

#else

WindowSsd best_window_ssd() { return window_ssd_plain; }

#endif

}  // namespace

std::uint64_t window_ssd_plain(const WindowRows& window, const std::int16_t* data, const std::ptrdiff_t* row_base,
                               std::ptrdiff_t first, std::uint64_t limit) {
  std::uint64_t total = 0;
  for (int i = 0; i < window.count; ++i) {
    const std::int16_t* x = data + row_base[window.rows[i]] + first;
    const std::int16_t* y = window.target + static_cast<std::size_t>(i) * window.row_length;
    const std::uint32_t* m = window.mask + static_cast<std::size_t>(i) * window.row_length / kRowStep;
    for (std::size_t k = 0; k < window.row_length; k += kRowStep) {
      std::uint32_t sum = 0;
      for (std::size_t l = 0; l < kRowStep; ++l) {
        const int d = (m[k / kRowStep] >> l & 1U) != 0 ? x[k + l] - y[k + l] : 0;
        sum += static_cast<std::uint32_t>(d * d);
      }
      total += sum;
    }
    if (i % kRowsBetweenChecks == kRowsBetweenChecks - 1 && total > limit) return total;
  }
  return total;
}

const WindowSsd window_ssd = best_window_ssd();

VENEER_CLONES
std::uint16_t cell_bounds(const TapRow* taps, std::size_t count, std::ptrdiff_t first, std::uint16_t scale,
                          std::uint16_t limit, std::uint16_t* bounds) {
  std::uint16_t sums[kCellsAtOnce] = {};
  std::uint16_t least = 0;
  for (std::size_t begin = 0; begin < count && least <= limit; begin += kTapsBetweenChecks) {
    const std::size_t end = std::min(begin + kTapsBetweenChecks, count);
    for (std::size_t t = begin; t < end; ++t) {
      const std::uint16_t* lo = taps[t].lo + first;
      const std::uint16_t* hi = taps[t].hi + first;
      const std::uint16_t target_lo = taps[t].target_lo, target_hi = taps[t].target_hi;
      for (int i = 0; i < kCellsAtOnce; ++i) {
        const auto above = static_cast<std::uint16_t>(lo[i] > target_hi ? lo[i] - target_hi : 0);
        const auto below = static_cast<std::uint16_t>(target_lo > hi[i] ? target_lo - hi[i] : 0);
        const auto scaled = static_cast<std::uint16_t>((static_cast<std::uint32_t>(above | below) * scale) >> 16);
        const auto d = static_cast<std::uint16_t>(scaled < 255 ? scaled : 255);
        const auto square = static_cast<std::uint16_t>(d * d);
        const auto room = static_cast<std::uint16_t>(65535 - square);
        sums[i] = static_cast<std::uint16_t>((sums[i] < room ? sums[i] : room) + square);
      }
    }
    least = 65535;
    for (const std::uint16_t s : sums) least = std::min(least, s);
  }
  std::copy(sums, sums + kCellsAtOnce, bounds);
  return least;
}

}  // namespace veneer::planner::kernels
