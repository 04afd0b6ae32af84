#include <gmock/gmock.h>

#include "tests/calib/reconciled_sheet.h"

namespace veneer {
namespace {

using calib::Difference;
using calib::DifferenceKind;
using namespace reconciled;

// The share of each pixel that an outline covers, whatever it is thinner than: open_up's outlines are a pixel wider.
void cover(Raster<PanelFrame>& map, const Outline& outline, const cv::Scalar& seen) {
  constexpr int kFiner = 8;
  cv::Mat fine = cv::Mat::zeros(map.pixels.size() * kFiner, CV_8UC1), share;
  std::vector<cv::Point> corners;
  for (const auto& p : outline) {
    double column = 0, row = 0;
    map.to_pixels(point<PanelFrame>(p.x, p.y), column, row);
    corners.emplace_back(cvRound(kFiner * column - 0.5), cvRound(kFiner * row - 0.5));
  }
  cv::fillPoly(fine, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
  cv::resize(fine, share, map.pixels.size(), 0, 0, cv::INTER_AREA);
  for (int r = 0; r < share.rows; ++r)
    for (int c = 0; c < share.cols; ++c)
      for (int k = 0; k < 3; ++k) {
        auto& level = map.pixels.at<cv::Vec3b>(r, c)[k];
        level = cv::saturate_cast<std::uint8_t>(level + (seen[k] - level) * share.at<std::uint8_t>(r, c) / 255);
      }
}

TEST(SmallDifferences, AHairOnTheGlassIsNoMissingWood) {
  const Outline hair = {{30, 30}, {30.08, 30}, {44, 60}, {43.92, 60}},
                fibre = {{60, 30}, {60.15, 30}, {60.15, 70}, {60, 70}};
  const Shelf warm;
  const GreyShelf grey;
  for (const Shelf* shelf : {&warm, static_cast<const Shelf*>(&grey)})
    for (const bool earlier : {false, true}) {
      auto before = shelf->map({}), now = shelf->map({}, 0, 9);
      for (const Outline& outline : {hair, fibre}) cover(earlier ? before : now, outline, cv::Scalar::all(40));
      const auto found = reconcile(before, now, {}, shelf->fiducials);
      ASSERT_TRUE(found.ok()) << found.error().message;
      EXPECT_TRUE(found->differences.empty()) << told(found->differences);
    }
}

TEST(SmallDifferences, AHoleOfThreeSquareMillimetresIsToldBesideACutToo) {
  const Outline hole = {{42, 35}, {44, 35}, {44, 36.6}, {42, 36.6}},
                alone = {{52, 60}, {54, 60}, {54, 61.5}, {52, 61.5}};
  const Shelf warm;
  const GreyShelf grey;
  for (const Shelf* shelf : {&warm, static_cast<const Shelf*>(&grey)}) {
    auto now = shelf->map({}, 0, 9);
    for (const Outline& outline : {kLight, hole, alone}) open_up(now, outline, cv::Scalar::all(24));
    const auto found = reconcile(shelf->map({}), now, regions_of({kLight}), shelf->fiducials);
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->differences.size(), 2U) << told(found->differences);
    for (const Difference& difference : found->differences) EXPECT_EQ(difference.kind, DifferenceKind::kGoneNotBooked);
  }
}

// What is left over of a lamp's light at a place is weak, and may be told apart from noise for all that.
TEST(SmallDifferences, AFaintPatchOfLightIsNoMissingWood) {
  Shelf shelf;
  shelf.noise = 0.7;
  for (const int off : {2, 3}) {  // grey levels
    auto now = shelf.map({}, 0, 9), patch = now;
    patch.pixels = cv::Mat(now.pixels.size(), CV_8UC3, cv::Scalar::all(0));
    open_up(patch, {{33, 40}, {35, 40}, {35, 41.7}, {33, 41.7}}, cv::Scalar::all(off));
    now.pixels += patch.pixels;
    const auto found = reconcile(shelf.map({}), now, {}, shelf.fiducials);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_TRUE(found->differences.empty()) << told(found->differences);
  }
}

}  // namespace
}  // namespace veneer
