#include "planner/suggest/mosaic_sketch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <stdexcept>

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// 100 x 100 mm of one tone, so that nothing but what is drawn says how its 10 x 10 cells lie.
Artwork plain_artwork() {
  Artwork out;
  out.name = "plain", out.letter = "A";
  out.width = out.height = 100_mm;
  out.picture = cv::Mat(200, 200, CV_8UC3, cv::Scalar::all(128));
  return out;
}

PlanOptions mosaic_options() {
  PlanOptions out;
  out.layout = LayoutKind::kMosaic, out.patch = 10_mm, out.threads = 1;
  return out;
}

MosaicPreview sketched(const Artwork& artwork, GridEffort effort, const PlanOptions& options = mosaic_options()) {
  auto out = sketch_mosaic(artwork, options, effort);
  if (!out.ok()) throw std::runtime_error(out.error().message);
  return std::move(*out);
}

// How long the borders are of which `counts` says so, by a step along them, in millimetres.
template <class F>
double border_length(const MosaicPreview& cells, F counts) {
  double out = 0;
  for (const auto& line : cells.lines)
    for (std::size_t i = 1; i < line.size(); ++i)
      if (counts(line[i - 1], line[i]))
        out += std::hypot((line[i].x - line[i - 1].x).count(), (line[i].y - line[i - 1].y).count());
  return out;
}

class MosaicSketch : public ::testing::TestWithParam<GridEffort> {};

TEST_P(MosaicSketch, ThereAreAboutAsManyCellsAsPatches) {
  const MosaicPreview cells = sketched(plain_artwork(), GetParam());
  EXPECT_NEAR(static_cast<double>(cells.cells), 100, 15);
  for (const auto& line : cells.lines) {
    ASSERT_GE(line.size(), 2U);
    for (const auto& at : line) {
      EXPECT_TRUE(at.x >= 0_mm && at.x <= 100_mm && at.y >= 0_mm && at.y <= 100_mm);
    }
  }
}

TEST_P(MosaicSketch, CellsAreSmallWhereThatIsPainted) {
  Artwork artwork = plain_artwork();
  artwork.guides.cell_sizes = cv::Mat(2, 2, CV_8UC1, cv::Scalar(0));
  artwork.guides.cell_sizes.row(0).setTo(255);  // of the upper half
  const MosaicPreview cells = sketched(artwork, GetParam());
  const double above = border_length(cells, [](const auto&from, const auto&) { return from.y > 60_mm; }),
               below = border_length(cells, [](const auto&from, const auto&) { return from.y < 40_mm; });
  EXPECT_GT(above, 1.3 * below);
}

TEST_P(MosaicSketch, CellsLieAlongWhatIsDrawn) {
  Artwork artwork = plain_artwork();
  PlanOptions options = mosaic_options();
  options.flow_lines_only = true, options.cell_aspect = 3;
  const auto slope = [](const auto& from, const auto& to) {  // 1 where it rises by 45 degrees, -1 where it falls
    return std::sin(2 * std::atan2((to.y - from.y).count(), (to.x - from.x).count()));
  };
  const auto rising = [&](const auto& from, const auto& to) { return slope(from, to) > 0.7; };
  const auto falling = [&](const auto& from, const auto& to) { return slope(from, to) < -0.7; };
  artwork.guides.flow_lines = {{{0, 10000}, {10000, 0}}};  // from the lower left corner to the upper right one
  const MosaicPreview up = sketched(artwork, GetParam(), options);
  EXPECT_GT(border_length(up, rising), 1.5 * border_length(up, falling));
  artwork.guides.flow_lines = {{{0, 0}, {10000, 10000}}};
  const MosaicPreview down = sketched(artwork, GetParam(), options);
  EXPECT_GT(border_length(down, falling), 1.5 * border_length(down, rising));
}

TEST_P(MosaicSketch, RefusesWhatAPlanWouldAndCellsThatNobodyCouldSee) {
  const auto refusal = [&](const Artwork& artwork, const PlanOptions& options) {
    const auto out = sketch_mosaic(artwork, options, GetParam());
    return out.ok() ? "" : out.error().message;
  };
  Artwork beside = plain_artwork();
  beside.guides.flow_lines = {{{-200, 0}, {-200, 10000}}};
  EXPECT_THAT(refusal(beside, mosaic_options()), HasSubstr("no flow line of \"plain\" runs over it"));
  PlanOptions options = mosaic_options();
  options.patch = 1_mm;
  EXPECT_THAT(refusal(plain_artwork(), options), HasSubstr("10000 pieces"));
  options.cell_aspect = 4;
  EXPECT_THAT(refusal(plain_artwork(), options), HasSubstr("are 0.5 mm wide"));
  options.cell_aspect = 1, options.layout = LayoutKind::kGrid;
  EXPECT_THAT(refusal(plain_artwork(), options), HasSubstr("only a mosaic has cells"));
}

INSTANTIATE_TEST_SUITE_P(Efforts, MosaicSketch, ::testing::Values(GridEffort::kCoarse, GridEffort::kFine));

}  // namespace
}  // namespace veneer::planner
