// The two inner loops of matching. Written for several instruction sets; the machine's best is chosen at start.
// Whole numbers only, so every machine gets the same result.
#pragma once

#include <cstddef>
#include <cstdint>

namespace veneer::planner::kernels {

// Entries that are compared at once; rows of windows are padded to a multiple.
inline constexpr std::size_t kRowStep = 32;
// The largest entry of a rotated panel, and of sums of up to kTallestSum of them.
inline constexpr int kLargestEntry = 1023;
inline constexpr int kTallestSum = 8;

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

// One block feature of the target against the interval [lo, hi] that the feature takes within each cell of a row.
struct TapRow {
  const std::uint16_t* lo;
  const std::uint16_t* hi;
  std::uint16_t target_lo, target_hi;  // the target's value, rounded down and up
};
inline constexpr int kCellsAtOnce = 32;
inline constexpr std::size_t kTapsBetweenChecks = 8;

// For kCellsAtOnce cells from `first`: the sum over taps of (distance * scale / 65536, rounded down)^2, saturated at
// 65535. Returns the smallest of them; stops early when all are above `limit`, leaving values above it.
std::uint16_t cell_bounds(const TapRow* taps, std::size_t count, std::ptrdiff_t first, std::uint16_t scale,
                          std::uint16_t limit, std::uint16_t* bounds);

// The plain version of window_ssd, for tests of the others.
std::uint64_t window_ssd_plain(const WindowRows& window, const std::int16_t* data, const std::ptrdiff_t* row_base,
                               std::ptrdiff_t first, std::uint64_t limit);

}  // namespace veneer::planner::kernels
