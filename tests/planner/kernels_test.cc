#include "planner/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace veneer::planner::kernels {
namespace {

TEST(WindowSsd, AllVersionsAgreeUpToTheLargestEntries) {
  std::mt19937 random(7);
  for (const int largest : {50, kLargestEntry, kLargestEntry * kTallestSum}) {
    for (const std::size_t length : {32U, 96U, 1056U}) {
      std::uniform_int_distribution<int> entry(0, largest);
      constexpr int kRows = 13;
      std::vector<std::int16_t> data(length * (kRows + 2) + 64), target(length * kRows);
      std::vector<std::uint32_t> mask(target.size() / kRowStep);
      for (auto& v : data) v = static_cast<std::int16_t>(entry(random));
      for (auto& v : target) v = static_cast<std::int16_t>(entry(random));
      for (auto& m : mask) m = random() % 3 == 0 ? static_cast<std::uint32_t>(random()) : 0xffffffffU;
      std::vector<int> rows(kRows);
      for (int i = 0; i < kRows; ++i) rows[static_cast<std::size_t>(i)] = (i * 5) % kRows;
      std::vector<std::ptrdiff_t> base;
      for (int i = 0; i < kRows; ++i) base.push_back(static_cast<std::ptrdiff_t>(length) * i);
      const WindowRows window{target.data(), mask.data(), length, rows.data(), kRows};
      const auto no_limit = std::numeric_limits<std::uint64_t>::max();
      const std::uint64_t whole = window_ssd_plain(window, data.data(), base.data(), 3, no_limit);
      EXPECT_EQ(window_ssd(window, data.data(), base.data(), 3, no_limit), whole);
      EXPECT_EQ(window_ssd(window, data.data(), base.data(), 3, whole), whole);
      EXPECT_GT(window_ssd(window, data.data(), base.data(), 3, whole / 2), whole / 2);
    }
  }
}

TEST(CellBounds, AreTheSaturatedSumOfSquaredDistancesToIntervals) {
  std::mt19937 random(8);
  std::uniform_int_distribution<int> value(0, 9000);
  constexpr std::size_t kTaps = 19;
  std::vector<std::uint16_t> lo(kTaps * 40), hi(kTaps * 40);
  std::vector<TapRow> taps;
  for (std::size_t t = 0; t < kTaps; ++t) {
    for (std::size_t i = 0; i < 40; ++i) {
      lo[t * 40 + i] = static_cast<std::uint16_t>(value(random));
      hi[t * 40 + i] = static_cast<std::uint16_t>(lo[t * 40 + i] + value(random) / 8);
    }
    const auto y = static_cast<std::uint16_t>(value(random));
    taps.push_back({lo.data() + t * 40, hi.data() + t * 40, y, static_cast<std::uint16_t>(y + 1)});
  }
  for (const int shift : {3, 6, 8}) {
    std::uint16_t bounds[kCellsAtOnce];
    const std::uint16_t least =
        cell_bounds(taps.data(), kTaps, 5, static_cast<std::uint16_t>(65536 >> shift), 65535, bounds);
    EXPECT_EQ(least, *std::min_element(std::begin(bounds), std::end(bounds)));
    for (std::size_t i = 0; i < kCellsAtOnce; ++i) {
      long sum = 0;
      for (const TapRow& tap : taps) {
        const int low = tap.lo[5 + i], high = tap.hi[5 + i];
        const int distance = std::max({0, low - tap.target_hi, tap.target_lo - high});
        const long d = std::min(255, distance >> shift);
        sum += d * d;
      }
      EXPECT_EQ(bounds[i], std::min(sum, 65535L));
    }
  }
}

}  // namespace
}  // namespace veneer::planner::kernels
