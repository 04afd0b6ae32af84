// Where a scan says that the panel's wood lies, and what it says when it cannot tell.
#include <gmock/gmock.h>

#include "tests/calib/scanned_panel.h"

namespace veneer {
namespace {

using calib::FitResidual;
using calib::PanelFiducials;
using calib::RegistrationOptions;
using calib::TileView;
using scanned::Cell;
using scanned::error_of;
using scanned::plain_cell;
using scanned::plain_fiducials;
using scanned::plain_show;

TEST(Registration, OfALinearScannerIsBelowTenMicrometres) {
  const Cell cell(false, 300);
  const auto pose = cell.whole(Face::kShow);
  const TileView tiles[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const FitResidual error = error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials);
  EXPECT_LT(error.rms, 0.010);
  EXPECT_LT(error.max, 0.020);
  EXPECT_FALSE(found->rms.has_value());  // one tile has nothing to disagree with
  EXPECT_EQ(found->fiducials.tags.size(), 5U);
  EXPECT_EQ(found->fiducials.holes.size(), 4U);
}

TEST(Registration, PutsTheOriginAtTheSheetsLowerLeftCornerAsItsTagsStand) {
  for (const double angle : {0.0, 2.0, -88.0, 179.0}) {
    Cell cell;
    if (std::abs(angle) > 45 && std::abs(angle) < 135) std::swap(cell.scanner.width_mm, cell.scanner.height_mm);
    const auto pose = rendered::lay(75, 55, cell.scanner.width_mm / 2, cell.scanner.height_mm / 2, angle, Face::kShow);
    const TileView tiles[] = {cell.scan(Face::kShow, pose)};
    const auto found = register_first_scan(tiles, cell.model);
    ASSERT_TRUE(found.ok()) << found.error().message;
    for (const auto& corner : {point<PanelFrame>(0, 0), point<PanelFrame>(150, 110)}) {
      const Point<PanelFrame> seems = found->tiles[0] * cell.scanner.scan_from_glass(pose * corner);
      EXPECT_LT(distance(seems, corner).count(), 0.06) << angle;
    }
    EXPECT_NEAR(found->sheet.width().count(), 150, 0.06);
    EXPECT_NEAR(found->sheet.height().count(), 110, 0.06);
  }
}

TEST(Registration, FitsALaterScanToTheFrozenFiducials) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  const auto pose = cell.whole(Face::kShow, 178);
  const TileView later[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_scan(later, Face::kShow, known, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(found->rms->count(), 0.01);
  EXPECT_LT(error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials).rms, 0.010);
  EXPECT_EQ(found->fiducials.tags[0].corners, known.tags[0].corners);
}

// The first trap: tags and holes counted by two conventions, half a pixel apart, disagree across a half turn.
TEST(Registration, SeesHalfAPixelOfOffset) {
  const Cell& cell = plain_cell();
  const PanelFiducials known = plain_fiducials();
  TileView shifted = cell.scan(Face::kShow, cell.whole(Face::kShow, 179));
  ASSERT_TRUE(register_scan(std::span(&shifted, 1), Face::kShow, known, cell.model).ok());
  for (auto& hole : shifted.holes) hole.centre.x += Pixels(0.5), hole.centre.y += Pixels(0.5);
  const auto found = register_scan(std::span(&shifted, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
}

TEST(Registration, NamesWhatIsWrongInOneSentence) {
  const Cell& cell = plain_cell();
  const TileView& good = plain_show();
  const PanelFiducials known = plain_fiducials();

  TileView bare = good;
  bare.tags.clear();
  auto answer = register_first_scan(std::span(&bare, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("no fiducials found on scan 7"));

  TileView few = good;
  few.tags.resize(2);
  answer = register_first_scan(std::span(&few, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("2 of at least 3 tags"));

  RegistrationOptions options;
  options.foreign_tags = {203};
  answer = register_first_scan(std::span(&good, 1), cell.model, options);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("tag 203 on scan 7 belongs to another sheet"));

  TileView stranger = good;
  for (auto& tag : stranger.tags) tag.id += 100;
  answer = register_scan(std::span(&stranger, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("another panel lies on the glass"));

  stranger = good;
  stranger.tags.back().id = 300;
  answer = register_scan(std::span(&stranger, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("tag 300 does not belong"));

  TileView stretched = good;
  stretched.nominal = ScanResolution::from_dpi(290);
  answer = register_first_scan(std::span(&stretched, 1), cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("instead of 14.00"));

  TileView warped = good;  // everything moved, as no glue does
  for (auto& tag : warped.tags)
    for (auto& corner : tag.corners) corner.x = corner.x * 1.003;
  warped.holes.clear();
  answer = register_scan(std::span(&warped, 1), Face::kShow, known, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("calibrate the scanner"));

  TileView apart = good;
  apart.name = "scan 8";
  for (auto& tag : apart.tags) tag.id += 100;
  const TileView tiles[] = {good, apart};
  answer = register_first_scan(tiles, cell.model);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, ::testing::HasSubstr("scan 8 shares no tag"));
}

}  // namespace
}  // namespace veneer
