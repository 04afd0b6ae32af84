#include "planner/matching/score_kernels.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace veneer::planner::kernels {
namespace {

TEST(ScoreKernels, EveryVersionGivesThePlainOnesNumbers) {
  std::mt19937 random(7);
  const auto entry = [&] { return static_cast<std::int16_t>(random() % 8191) - 4095; };
  for (const auto& shape : {std::array{1, 6, 6}, std::array{2, 3, 5}, std::array{3, 1, 1}}) {
    const int pairs = shape[0], rows = shape[1], columns = shape[2];
    constexpr std::size_t kCells = 300;
    std::vector<std::vector<std::int16_t>> maps;
    std::vector<const std::int16_t*> blocks;
    for (int i = 0; i < pairs * rows; ++i) {
      auto& map = maps.emplace_back(2 * (kCells + 64));
      for (auto& value : map) value = static_cast<std::int16_t>(entry());
    }
    for (const auto& map : maps) blocks.push_back(map.data());
    std::vector<std::int32_t> offsets(kCells + 64), taps;
    for (auto& offset : offsets) offset = static_cast<std::int32_t>(random() % (1U << 28));
    for (int i = 0; i < pairs * rows * columns; ++i) {
      const auto low = static_cast<std::uint16_t>(entry()), high = static_cast<std::uint16_t>(entry());
      taps.push_back(static_cast<std::int32_t>(low | static_cast<std::uint32_t>(high) << 16));
    }
    // A number of groups that no unrolling divides; side by side, overlapping and out of order.
    const std::vector<std::uint32_t> groups{16, 32, 48, 64, 0, 5, 240, 96, 33, 128, 144};
    const auto run = [&](ScoreGroups kernel) {
      std::vector<std::int32_t> scores(groups.size() * kGroup);
      std::vector<std::uint16_t> below(groups.size());
      kernel({taps.data(), pairs, rows, columns}, {blocks.data(), offsets.data()}, groups.data(), groups.size(),
             1 << 27, scores.data(), below.data());
      return std::pair(scores, below);
    };
    const auto versions = score_versions();
    EXPECT_EQ(score_groups, versions.back().run);
    for (const ScoreVersion& version : versions) EXPECT_EQ(run(version.run), run(versions.front().run)) << version.name;
  }
}

}  // namespace
}  // namespace veneer::planner::kernels
