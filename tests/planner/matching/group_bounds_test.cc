#include "planner/matching/group_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace veneer::planner {
namespace {

using kernels::kGroup;

// A row of cells like wood: bright and dark stretches with texture, in two or three channels.
struct Row {
  static constexpr std::size_t kGroups = 40, kCells = kGroups * kGroup;
  int channels, rows = 6, columns = 6;
  std::vector<std::vector<std::int16_t>> maps;  // [pair * rows + block row]
  std::vector<const std::int16_t*> blocks;
  std::vector<std::int32_t> offsets;
  std::vector<std::uint16_t> alive;

  Row(int channel_count, int largest, std::uint32_t seed) : channels(channel_count) {
    std::mt19937 random(seed);
    const int pairs = (channels + 1) / 2;
    for (int i = 0; i < pairs * rows; ++i) {
      auto& map = maps.emplace_back(2 * (kCells + 80));
      int tone = 0;
      for (std::size_t k = 0; k < kCells + 80; ++k) {
        if (k % 97 == 0) tone = static_cast<int>(random() % static_cast<unsigned>(largest));
        for (int ch = 0; ch < 2; ++ch) {
          if (2 * (i / rows) + ch >= channels) continue;
          const int texture = static_cast<int>(random() % static_cast<unsigned>(largest / 8 + 1));
          map[2 * k + static_cast<std::size_t>(ch)] =
              static_cast<std::int16_t>(std::clamp((ch == 0 ? tone : tone / 3) + texture, -largest, largest));
        }
      }
    }
    for (const auto& map : maps) blocks.push_back(map.data());
    for (std::size_t cell = 0; cell < kCells + 64; ++cell) {
      std::int64_t squares = 0;
      for (int channel = 0; channel < channels && cell < kCells; ++channel)
        for (const int c : windowed(channel, cell)) squares += static_cast<std::int64_t>(c) * c;
      // Half the blocks' squares, rounded, and what deviates within blocks; a little less where that was rounded.
      offsets.push_back(static_cast<std::int32_t>(squares / 2 + static_cast<int>(random() % 5000) - 20));
    }
    for (std::size_t g = 0; g < kGroups; ++g) alive.push_back(static_cast<std::uint16_t>(g % 5 == 0 ? 0 : random()));
  }

  // The blocks of a cell's window.
  std::vector<int> windowed(int channel, std::size_t cell) const {
    std::vector<int> out;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c)
        out.push_back(maps[static_cast<std::size_t>(channel / 2 * rows + r)]
                          [2 * (cell + 2 * static_cast<std::size_t>(c)) + static_cast<std::size_t>(channel % 2)]);
    return out;
  }
  // Taps that look for what lies at a cell, a little different.
  std::vector<std::int32_t> taps_for(std::size_t cell, int noise, std::mt19937& random) const {
    std::vector<std::int32_t> taps(maps.size() * static_cast<std::size_t>(columns), 0);
    for (int channel = 0; channel < channels; ++channel) {
      const std::vector<int> wanted = windowed(channel, cell);
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        const int tap = -(wanted[i] + static_cast<int>(random() % static_cast<unsigned>(noise)));
        const auto bits = static_cast<std::uint32_t>(static_cast<std::uint16_t>(tap));
        taps[static_cast<std::size_t>(channel / 2) * wanted.size() + i] |=
            static_cast<std::int32_t>(channel % 2 == 0 ? bits : bits << 16);
      }
    }
    return taps;
  }
};

TEST(GroupBounds, NeverLeaveOutAScoreBelowTheLimitAndLeaveOutMost) {
  std::mt19937 random(3);
  std::size_t asked = 0, left_out = 0;
  for (const int channels : {1, 2, 3}) {
    for (const int largest : {40, 2700}) {
      const Row row(channels, largest, static_cast<std::uint32_t>(channels * largest));
      // The groups lie behind others.
      constexpr std::size_t kFirst = 3;
      GroupBounds bounds(channels, kFirst + Row::kGroups);
      bounds.measure(kFirst, Row::kGroups, {row.blocks.data(), row.offsets.data()}, row.rows, row.columns,
                     row.alive.data());
      for (int trial = 0; trial < 20; ++trial) {
        const std::vector<std::int32_t> numbers = row.taps_for(random() % Row::kCells, 1 + largest / 20, random);
        const kernels::BlockTaps taps{numbers.data(), (channels + 1) / 2, row.rows, row.columns};
        std::vector<std::uint32_t> groups;
        for (std::size_t g = 0; g < Row::kGroups; ++g) groups.push_back(static_cast<std::uint32_t>(g * kGroup));
        std::vector<std::int32_t> scores(Row::kCells);
        std::vector<std::uint16_t> below(Row::kGroups);
        kernels::score_groups(taps, {row.blocks.data(), row.offsets.data()}, groups.data(), groups.size(), 0,
                              scores.data(), below.data());
        const TapSums sums = tap_sums(taps, channels);
        std::vector<float> found;
        bounds.find(sums, found);
        ASSERT_EQ(found.size(), kFirst + Row::kGroups);
        for (std::size_t g = 0; g < kFirst; ++g) EXPECT_LE(found[g], sums.most(-(1 << 29))) << "nothing is known";
        std::vector<std::int32_t> sorted = scores;
        std::sort(sorted.begin(), sorted.end());
        for (const std::int32_t limit : {sorted[0] + 1, sorted[20], sorted[Row::kCells / 2]}) {
          for (std::size_t g = 0; g < Row::kGroups; ++g) {
            if (row.alive[g] == 0) continue;
            ++asked;
            if (found[kFirst + g] <= sums.most(limit)) continue;
            ++left_out;
            for (std::size_t k = 0; k < kGroup; ++k) {
              if ((row.alive[g] >> k & 1) == 0) continue;
              ASSERT_GE(scores[g * kGroup + k], limit) << channels << " channels, group " << g;
            }
          }
        }
      }
    }
  }
  EXPECT_GT(left_out, asked / 3);
}

}  // namespace
}  // namespace veneer::planner
