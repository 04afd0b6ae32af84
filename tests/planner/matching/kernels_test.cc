// Every version of a kernel that this machine can run, against what the header says in whole numbers.
#include "planner/matching/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace veneer::planner::kernels {
namespace {

TEST(WindowSsd, AllVersionsAgreeUpToTheLargestEntries) {
  std::mt19937 random(7);
  for (const int largest : {50, 1023, kLargestEntry}) {
    for (const std::size_t length : {32U, 96U, 1056U}) {
      // The extremes too: entries that are all as far apart as they can be.
      for (const bool extreme : {false, true}) {
        std::uniform_int_distribution<int> entry(0, largest);
        constexpr int kRows = 13;
        std::vector<std::int16_t> data(length * (kRows + 2) + 64), target(length * kRows);
        std::vector<std::uint32_t> mask(target.size() / kRowStep);
        for (auto& v : data) v = static_cast<std::int16_t>(extreme ? largest : entry(random));
        for (auto& v : target) v = static_cast<std::int16_t>(extreme ? 0 : entry(random));
        for (auto& m : mask) m = !extreme && random() % 3 == 0 ? static_cast<std::uint32_t>(random()) : 0xffffffffU;
        std::vector<int> rows(kRows);
        for (int i = 0; i < kRows; ++i) rows[static_cast<std::size_t>(i)] = (i * 5) % kRows;
        std::vector<std::ptrdiff_t> base;
        for (int i = 0; i < kRows; ++i) base.push_back(static_cast<std::ptrdiff_t>(length) * i);
        std::uint64_t expected = 0;
        for (std::size_t i = 0; i < target.size(); ++i) {
          if ((mask[i / kRowStep] >> (i % kRowStep) & 1U) == 0) continue;
          const auto row = static_cast<std::size_t>(rows[i / length]);
          const std::int64_t d = data[row * length + 3 + i % length] - target[i];
          expected += static_cast<std::uint64_t>(d * d);
        }
        const WindowRows window{target.data(), mask.data(), length, rows.data(), kRows};
        for (const Versions& version : versions()) {
          SCOPED_TRACE(version.name);
          const auto run = [&](std::uint64_t limit) {
            return version.window_ssd(window, data.data(), base.data(), 3, limit);
          };
          EXPECT_EQ(run(std::numeric_limits<std::uint64_t>::max()), expected);
          EXPECT_EQ(run(expected), expected);
          EXPECT_GT(run(expected / 2), expected / 2);
        }
      }
    }
  }
}

TEST(RowSums, AreRoundedEighthsOfSumsOfRows) {
  std::mt19937 random(9);
  std::uniform_int_distribution<int> entry(0, kLargestEntry);
  constexpr std::size_t kLength = 3 * kRowStep, kStride = kLength + 7;
  for (const int height : {2, 5, kTallestSum}) {
    constexpr int kGroups = 3, kShifts = 4;
    std::vector<std::int16_t> data(kStride * static_cast<std::size_t>(kGroups * height + kShifts) + 64);
    for (auto& v : data) v = static_cast<std::int16_t>(random() % 4 == 0 ? kLargestEntry : entry(random));
    std::fill_n(data.begin(), data.size() / 2, static_cast<std::int16_t>(kLargestEntry));
    std::vector<std::ptrdiff_t> base;
    for (int i = 0; i < kGroups * height + kShifts; ++i) base.push_back(static_cast<std::ptrdiff_t>(kStride) * i);
    for (const Versions& version : versions()) {
      SCOPED_TRACE(version.name);
      std::vector<std::int16_t> sums(kLength * kGroups * kShifts, -1);
      version.row_sums(data.data(), base.data(), 5, height, kGroups, kShifts, kLength, sums.data());
      for (int s = 0; s < kShifts; ++s) {
        for (int g = 0; g < kGroups; ++g) {
          for (std::size_t i = 0; i < kLength; ++i) {
            int sum = 0;
            for (int r = 0; r < height; ++r)
              sum += data[kStride * static_cast<std::size_t>(g * height + s + r) + 5 + i];
            ASSERT_EQ(sums[static_cast<std::size_t>(s * kGroups + g) * kLength + i],
                      (sum + kSumDivisor / 2) / kSumDivisor);
          }
        }
      }
    }
  }
}

TEST(CellBounds, AreTheSaturatedSumOfSquaredDistancesToIntervals) {
  std::mt19937 random(8);
  constexpr std::size_t kTaps = 19;
  for (const int largest : {900, 9000, 65000}) {
    std::uniform_int_distribution<int> value(0, largest);
    std::vector<std::uint16_t> lo(kTaps * 40), hi(kTaps * 40);
    std::vector<TapRow> taps;
    for (std::size_t t = 0; t < kTaps; ++t) {
      for (std::size_t i = 0; i < 40; ++i) {
        lo[t * 40 + i] = static_cast<std::uint16_t>(value(random));
        hi[t * 40 + i] = static_cast<std::uint16_t>(std::min(65535, lo[t * 40 + i] + value(random) / 8));
      }
      const auto y = static_cast<std::uint16_t>(value(random));
      taps.push_back({lo.data() + t * 40, hi.data() + t * 40, y, static_cast<std::uint16_t>(y + 1)});
    }
    for (const int shift : {0, 3, 6, 10}) {
      std::vector<long> expected;
      for (std::size_t i = 0; i < kCellsAtOnce; ++i) {
        long sum = 0;
        for (const TapRow& tap : taps) {
          const int low = tap.lo[5 + i], high = tap.hi[5 + i];
          const long distance = std::max({0, low - tap.target_hi, tap.target_lo - high});
          const long d = std::min(distance, 65535L >> shift) << shift;
          sum += d * d >> 16;
        }
        expected.push_back(std::min(sum, 65535L));
      }
      std::vector<long> sorted = expected;
      std::sort(sorted.begin(), sorted.end());
      for (const Versions& version : versions()) {
        SCOPED_TRACE(version.name);
        std::uint16_t bounds[kCellsAtOnce];
        EXPECT_EQ(version.cell_bounds(taps.data(), kTaps, 5, shift, 65535, bounds), 0xffffffffU);
        for (std::size_t i = 0; i < kCellsAtOnce; ++i) EXPECT_EQ(bounds[i], expected[i]);
        for (const long limit : {sorted[3], sorted[20]}) {
          const std::uint32_t within =
              version.cell_bounds(taps.data(), kTaps, 5, shift, static_cast<std::uint16_t>(limit), bounds);
          for (std::size_t i = 0; i < kCellsAtOnce; ++i) {
            EXPECT_EQ(within >> i & 1U, expected[i] <= limit ? 1U : 0U);
            if (expected[i] <= limit) {
              EXPECT_EQ(bounds[i], expected[i]);
            }
          }
        }
        if (sorted[0] > 0) {
          EXPECT_EQ(
              version.cell_bounds(taps.data(), kTaps, 5, shift, static_cast<std::uint16_t>(sorted[0] - 1), bounds), 0U);
        }
      }
    }
  }
}

}  // namespace
}  // namespace veneer::planner::kernels
