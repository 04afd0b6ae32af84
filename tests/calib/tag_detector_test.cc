#include "calib/tag_detector.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
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

// A blot with a soft rim, as a spark or a finger leaves it.
void blot(cv::Mat& picture, const Point<ScanFrame>& at, double radius_px, const cv::Scalar& colour, double opaque) {
  for (int r = 0; r < picture.rows; ++r)
    for (int c = 0; c < picture.cols; ++c) {
      const double inside = radius_px - std::hypot(c + 0.5 - at.x.count(), r + 0.5 - at.y.count());
      const double a = opaque * std::clamp(inside / (0.3 * radius_px) + 0.5, 0.0, 1.0);
      if (a <= 0) continue;
      for (int k = 0; k < 3; ++k) {
        auto& level = picture.at<cv::Vec3b>(r, c)[k];
        level = cv::saturate_cast<unsigned char>(level * (1 - a) + colour[k] * a);
      }
    }
}

// The rest of its two sides tells where a corner is that a spark has burnt away.
TEST(TagDetector, SeesPastAScorchedCorner) {
  const OneBoard board(Face::kShow, 20);
  const cv::Mat clean = board.scan();
  const double px = board.scanner.nominal().px_per_mm;
  const auto corners = board.panel.tags[0].corners();
  int found = 0;
  for (std::size_t corner = 0; corner < 4; ++corner)
    for (const double radius_mm : {0.5, 1.0, 1.7})
      for (const auto& [dx, dy] : {std::pair{0.9, -0.6}, {-0.5, 0.8}}) {
        cv::Mat picture = clean.clone();
        const Point<ScanFrame> at = board.truth(corners[corner]);
        blot(picture, {at.x + Pixels(dx * px), at.y + Pixels(dy * px)}, radius_mm * px, {20, 26, 34}, 0.9);
        const auto tags = detect_tags<ScanFrame>(picture, {.decimate = 4});
        // Where so much is gone that it is not found, nobody is harmed.
        if (tags.size() == 1 && radius_mm > 0.5) continue;
        ASSERT_EQ(tags.size(), 2U);
        ++found;
        EXPECT_LT(worst_px(board, tags), 0.1)
            << "corner " << corner << ", " << radius_mm << " mm at " << dx << " " << dy;
      }
  EXPECT_GE(found, 16) << "of 24";
}

TEST(TagDetector, SeesPastAStainOnTheRim) {
  const OneBoard board(Face::kShow, -35);
  const cv::Mat clean = board.scan();
  const double px = board.scanner.nominal().px_per_mm;
  for (const double across : {-7.5, -5.0, 2.0, 6.5})
    for (const double radius_mm : {1.0, 2.2, 4.4}) {
      cv::Mat picture = clean.clone();
      blot(picture, board.truth(point<PanelFrame>(18.2 + across, 17.3 + 7)), radius_mm * px, {60, 100, 130}, 0.35);
      const auto tags = detect_tags<ScanFrame>(picture, {.decimate = 4});
      ASSERT_EQ(tags.size(), 2U);
      EXPECT_LT(worst_px(board, tags), 0.1) << across << ", " << radius_mm << " mm";
    }
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
