// The inner loops of certified matching. Written for several instruction sets; the machine's best is chosen at start.
// Whole numbers only, so every machine gets the same result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace veneer::planner::kernels {

// Entries that are compared at once; rows of windows are padded to a multiple.
inline constexpr std::size_t kRowStep = 32;
// The largest entry of a rotated panel: 28 sums of two squares of such numbers fit 32 bits.
inline constexpr int kLargestEntry = 8191;

// Rows of target entries to compare with one place of a rotated panel.
struct WindowRows {
  const std::int16_t* target;  // row i at target + i * row_length
  const std::uint32_t* mask;   // one bit an entry: it counts; row i at mask + i * row_length / kRowStep
  std::size_t row_length;      // a multiple of kRowStep, below 2^16
  const int* rows;             // row i is compared with the panel's row rows[i], counted from the place
  int count;
};

// Sum of squared differences; stops early, with some value above `limit`, once it is above.
// The panel's row r has its entries at data[row_base[r] + first].
using WindowSsd = std::uint64_t (*)(const WindowRows& window, const std::int16_t* data, const std::ptrdiff_t* row_base,
                                    std::ptrdiff_t first, std::uint64_t limit);
extern const WindowSsd window_ssd;

// Sums of `height` rows of entries, an eighth of them, rounded: what a window is compared with first. At most
// kTallestSum rows, so that sums fit 16 bits before they are divided.
inline constexpr int kTallestSum = 8;
inline constexpr int kSumDivisor = 8;
// For group g in [0, groups) and shift s in [0, shifts): out[(s * groups + g) * length + i] is the sum over the rows
// [g * height + s, g * height + s + height) of entry first + i. `length` is a multiple of kRowStep.
using RowSums = void (*)(const std::int16_t* data, const std::ptrdiff_t* row_base, std::ptrdiff_t first, int height,
                         int groups, int shifts, std::size_t length, std::int16_t* out);
extern const RowSums row_sums;

// One block feature of the target against the interval [lo, hi] that the feature takes within each cell of a row.
struct TapRow {
  const std::uint16_t* lo;
  const std::uint16_t* hi;
  std::uint16_t target_lo, target_hi;  // the target's value, rounded down and up
};
inline constexpr int kCellsAtOnce = 32;
inline constexpr std::size_t kTapsBetweenChecks = 8;

// For kCellsAtOnce cells from `first`: the sum over taps of (distance * 2^shift)^2 / 2^16, each rounded down and
// distances cut off where 16 bits end, saturated at 65535. Returns a bit for each cell whose sum is at most `limit`;
// stops early when there is none, with sums that are not finished.
using CellBounds = std::uint32_t (*)(const TapRow* taps, std::size_t count, std::ptrdiff_t first, int shift,
                                     std::uint16_t limit, std::uint16_t* bounds);
extern const CellBounds cell_bounds;

// Every version that this machine can run, the plain one first; for tests and benchmarks.
struct Versions {
  const char* name;
  WindowSsd window_ssd;
  RowSums row_sums;
  CellBounds cell_bounds;
};
std::span<const Versions> versions();

}  // namespace veneer::planner::kernels
