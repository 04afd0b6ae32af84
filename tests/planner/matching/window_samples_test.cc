#include "planner/matching/window_samples.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

namespace veneer::planner {
namespace {

cv::Mat random_entries(int columns, int rows, int channels) {
  cv::Mat out(rows, columns, CV_MAKETYPE(CV_16S, channels));
  cv::RNG random(5);
  random.fill(out, cv::RNG::UNIFORM, -4095, 4096);
  return out;
}

TEST(WindowSamples, AreBilinearAndTheBorderRepeats) {
  const cv::Mat entries = random_entries(40, 30, 1);
  for (const double angle : {0.0, 24.0, 90.0, 203.0}) {
    const Lattice lattice(entries.cols, entries.rows, degrees(angle));
    // Everything, and a good deal beyond.
    const SampleGrid grid{-3.3, -2.1, 1.25, 0.75, lattice.width(), 2 * lattice.height()};
    std::vector<std::int16_t> found(static_cast<std::size_t>(grid.columns * grid.rows));
    sample(entries, lattice, grid, static_cast<std::size_t>(grid.columns), found.data());
    for (int k = 0; k < grid.rows; ++k) {
      for (int i = 0; i < grid.columns; ++i) {
        double x = 0, y = 0;
        lattice.to_panel(grid.x + (i + 0.5) * grid.step_x, grid.y + (k + 0.5) * grid.step_y, x, y);
        x = std::clamp(x - 0.5, 0.0, entries.cols - 1.0), y = std::clamp(y - 0.5, 0.0, entries.rows - 1.0);
        const int c = std::min(static_cast<int>(x), entries.cols - 2),
                  r = std::min(static_cast<int>(y), entries.rows - 2);
        const auto at = [&](int row, int column) { return static_cast<double>(entries.at<std::int16_t>(row, column)); };
        const double fx = x - c, fy = y - r;
        const double expected = (1 - fy) * ((1 - fx) * at(r, c) + fx * at(r, c + 1)) +
                                fy * ((1 - fx) * at(r + 1, c) + fx * at(r + 1, c + 1));
        // Positions are rounded to 1/256 pixel.
        ASSERT_NEAR(found[static_cast<std::size_t>(k * grid.columns + i)], expected, 8192.0 * 2 / 256 + 1);
      }
    }
  }
}

TEST(WindowSamples, OfSeveralChannelsAreThoseOfEachAlone) {
  // Two channels have code of their own, and so have four.
  for (const std::size_t channels : {2U, 3U, 4U}) {
    const cv::Mat all = random_entries(50, 60, static_cast<int>(channels));
    std::vector<cv::Mat> alone;
    cv::split(all, alone);
    for (const double angle : {0.0, 48.0, 180.0, 312.0}) {
      const Lattice lattice(all.cols, all.rows, degrees(angle));
      for (const int columns : {1, 2, 17, lattice.width() + 9}) {
        const SampleGrid grid{-4, 20, 1, 1.5, columns, 25};
        const auto length = static_cast<std::size_t>(columns);
        std::vector<std::int16_t> together(channels * length * 25), one(length * 25);
        sample(all, lattice, grid, channels * length, together.data());
        for (std::size_t channel = 0; channel < channels; ++channel) {
          sample(alone[channel], lattice, grid, length, one.data());
          for (std::size_t i = 0; i < one.size(); ++i)
            ASSERT_EQ(together[channels * i + channel], one[i]) << angle << " " << i << " of " << channels;
        }
      }
    }
  }
}

// Of a patch that does not fill its window only what it covers is sampled.
TEST(WindowSamples, OfPartsAreThoseOfWholeRowsAndLeaveAloneWhatLiesBeside) {
  constexpr std::int16_t kAlone = 12345;  // no sample comes to that
  constexpr int kColumns = 23, kRows = 6;
  const std::vector<SampledPart> parts{{0, kColumns}, {5, 6}, {7, 7}, {9, 3}, {0, 11}, {13, kColumns}};
  for (const std::size_t channels : {1U, 2U, 3U, 4U}) {
    const cv::Mat entries = random_entries(50, 60, static_cast<int>(channels));
    for (const double angle : {0.0, 48.0, 180.0, 312.0}) {
      const Lattice lattice(entries.cols, entries.rows, degrees(angle));
      for (const double x : {-9.5, 20.0, lattice.width() - 8.0}) {  // beyond the panel on either side, and within it
        const SampleGrid grid{x, 20, 1, 1.5, kColumns, kRows};
        const std::size_t length = channels * kColumns + 3;  // and rows may lie farther apart
        std::vector<std::int16_t> whole(length * kRows, kAlone), some = whole;
        sample(entries, lattice, grid, length, whole.data());
        sample(entries, lattice, grid, length, some.data(), parts.data());
        for (std::size_t k = 0; k < parts.size(); ++k)
          for (std::size_t i = 0; i < length; ++i) {
            const int column = static_cast<int>(i / channels);
            const bool is_in = column >= parts[k].first && column < parts[k].last;
            ASSERT_EQ(some[k * length + i], is_in ? whole[k * length + i] : kAlone)
                << channels << " channels, " << angle << " degrees, row " << k << ", entry " << i;
          }
      }
    }
  }
}

}  // namespace
}  // namespace veneer::planner
