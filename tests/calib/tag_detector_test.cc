#include "calib/tag_detector.h"

#include <gmock/gmock.h>

#include <opencv2/imgproc.hpp>

#include "calib/tag_pattern.h"
#include "tests/support/label_reader.h"
#include "tests/support/rendered_panel.h"

namespace veneer {
namespace {

using calib::detect_tags;
using calib::Tag;
using rendered::GluedTag;

// A 60 x 50 mm board with two tags, one of them turned, seen by a perfect scanner.
struct OneBoard {
  rendered::Panel panel;
  rendered::Scanner scanner;
  Isometry2<GlassFrame, PanelFrame> glass_from_panel;

  explicit OneBoard(Face face = Face::kShow, double angle_deg = 0) {
    panel.width = 60, panel.height = 50;
    panel.tags = {{210, face, 18.2, 17.3, 3}, {211, face, 42.1, 31.6, 90}};
    scanner.width_mm = 84, scanner.height_mm = 76;
    glass_from_panel = rendered::lay(30, 25, 42, 38, angle_deg, face);
  }
  cv::Mat scan(Face face = Face::kShow) const { return scan_panel(panel, face, glass_from_panel, scanner); }
  Point<ScanFrame> truth(const Point<PanelFrame>& p) const { return scanner.scan_from_glass(glass_from_panel * p); }
};

double worst_px(const OneBoard& board, const std::vector<Tag<ScanFrame>>& tags) {
  double worst = 0;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const auto truth = board.panel.tags[t].corners();
    for (std::size_t i = 0; i < 4; ++i)
      worst = std::max(worst, distance(tags[t].corners[i], board.truth(truth[i])).count());
  }
  return worst;
}

TEST(TagDetector, CountsPixelCentresAtOneHalf) {
  // Half a pixel of confusion is 0.5 px; the corners must be far nearer than that.
  const OneBoard board;
  const auto tags = detect_tags<ScanFrame>(board.scan());
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[0].id, 210);
  EXPECT_EQ(tags[1].id, 211);
  EXPECT_LT(worst_px(board, tags), 0.05);
}

TEST(TagDetector, FindsCornersBelowTenMicrometresAtAnyAngle) {
  for (const double angle : {7.0, 45.0, 133.0, 180.0, 261.0}) {
    const OneBoard board(Face::kShow, angle);
    const auto tags = detect_tags<ScanFrame>(board.scan());
    ASSERT_EQ(tags.size(), 2U) << angle;
    EXPECT_LT(worst_px(board, tags), 0.05) << angle;
  }
}

TEST(TagDetector, KeepsItsAccuracyWhenSearchingCoarsely) {
  const OneBoard board(Face::kShow, 20);
  const auto tags = detect_tags<ScanFrame>(board.scan(), {.decimate = 4});
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_LT(worst_px(board, tags), 0.05);
}

TEST(TagDetector, NamesCornersCounterClockwiseFromTheLowerLeft) {
  const OneBoard board;
  const auto tags = detect_tags<ScanFrame>(board.scan());
  ASSERT_EQ(tags.size(), 2U);
  const auto& c = tags[0].corners;  // almost upright
  EXPECT_LT(c[0].x, c[1].x);
  EXPECT_GT(c[0].y, c[3].y);  // y runs down
  EXPECT_LT(c[3].x, c[2].x);
  EXPECT_GT(c[1].y, c[2].y);
}

TEST(TagDetector, SeesATagPrintedUpsideDownTurnedByHalf) {
  OneBoard board;
  board.panel.tags[0].upside_down = true;
  const auto tags = detect_tags<ScanFrame>(board.scan());
  ASSERT_EQ(tags.size(), 2U);
  const auto truth = board.panel.tags[0].corners();
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LT(distance(tags[0].corners[i], board.truth(truth[(i + 2) % 4])).count(), 0.1);
}

TEST(TagDetector, ReadsTheBackUnmirrored) {
  const OneBoard board(Face::kBack, 12);
  const auto tags = detect_tags<ScanFrame>(board.scan(Face::kBack));
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_LT(worst_px(board, tags), 0.05);
}

TEST(TagDetector, DoesNotReadAMirroredPicture) {
  const OneBoard board;
  cv::Mat mirrored;
  cv::flip(board.scan(), mirrored, 1);
  EXPECT_TRUE(detect_tags<ScanFrame>(mirrored).empty());
}

TEST(TagDetector, StandsBlurLowContrastAndNoise) {
  OneBoard board(Face::kShow, 4);
  board.scanner.optics.psf_px = 1.2;
  board.scanner.optics.noise = 6;
  cv::Mat picture = board.scan();
  picture.convertTo(picture, -1, 0.6, 50);
  const auto tags = detect_tags<ScanFrame>(picture);
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_LT(worst_px(board, tags), 0.3);
}

TEST(TagDetector, TakesGreyAndRefusesOtherPictures) {
  const OneBoard board;
  cv::Mat grey, deep;
  cv::cvtColor(board.scan(), grey, cv::COLOR_BGR2GRAY);
  EXPECT_EQ(detect_tags<CameraFrame>(grey).size(), 2U);
  grey.convertTo(deep, CV_16U);
  EXPECT_TRUE(detect_tags<ScanFrame>(deep).empty());
  EXPECT_TRUE(detect_tags<ScanFrame>(cv::Mat()).empty());
}

// A label may lie on the glass or on the bed, or be stuck on a panel.
TEST(TagDetector, TakesNoTagOfALabelForAFiducial) {
  constexpr int kCells = calib::LabelTagPattern::kCells, kCell = 6, kPitch = (kCells + 1) * kCell, kAcross = 46;
  cv::Mat sheet(kAcross * kPitch, kAcross * kPitch, CV_8UC1, cv::Scalar(235));
  std::vector<int> all;
  for (int id = 0; id < calib::kLabelTagIds; ++id) {
    const auto tag = calib::label_tag_pattern(id);
    ASSERT_TRUE(tag.ok());
    const cv::Point corner(id % kAcross * kPitch + kCell / 2, id / kAcross * kPitch + kCell / 2);
    for (int row = 0; row < kCells; ++row)
      for (int column = 0; column < kCells; ++column)
        if (tag->black[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)])
          sheet(cv::Rect(corner.x + column * kCell, corner.y + row * kCell, kCell, kCell)) = 25;
    all.push_back(id);
  }
  EXPECT_FALSE(calib::label_tag_pattern(calib::kLabelTagIds).ok());
  EXPECT_EQ(tests::label_tags_on(sheet), all) << "as others read them";
  for (const double decimate : {1.0, 2.0}) EXPECT_TRUE(detect_tags<ScanFrame>(sheet, {decimate}).empty());
  EXPECT_TRUE(detect_tags<ScanFrame>(255 - sheet).empty()) << "in a negative";
  cv::Mat mirrored;
  cv::flip(sheet, mirrored, 1);
  EXPECT_TRUE(detect_tags<CameraFrame>(mirrored).empty());
}

}  // namespace
}  // namespace veneer
