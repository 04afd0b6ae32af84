// The same with a warped scanner and its certificate, and where tiles are joined.
#include <gmock/gmock.h>

#include "tests/calib/scanned_panel.h"

namespace veneer {
namespace {

using calib::FitResidual;
using calib::ScannerModel;
using calib::TileView;
using scanned::Cell;
using scanned::error_of;
using scanned::warped_cell;

TEST(Registration, OfAWarpedScannerWithItsCertificateIsBelowThirtyMicrometres) {
  const Cell& cell = warped_cell();
  const auto pose = cell.whole(Face::kShow, 3);
  const TileView tiles[] = {cell.scan(Face::kShow, pose)};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const FitResidual error = error_of(cell, found->tiles[0], pose, Face::kShow, found->fiducials);
  EXPECT_LT(error.rms, 0.030);
  EXPECT_LT(error.max, 0.080);
  // Without the certificate the warp stays in.
  const auto naive = register_first_scan(tiles, ScannerModel());
  ASSERT_TRUE(naive.ok());
  EXPECT_GT(error_of(cell, naive->tiles[0], pose, Face::kShow, naive->fiducials).rms, 3 * error.rms);
}

TEST(Registration, JoinsTilesAndMeasuresTheirDisagreement) {
  Cell cell = warped_cell();
  cell.panel = rendered::sample_panel(230, 110, 4);
  const auto left = rendered::lay(0, 55, 8, 70, 0.7, Face::kShow),
             right = rendered::lay(230, 55, 172, 71, -1.1, Face::kShow);
  const TileView tiles[] = {cell.scan(Face::kShow, left, "tile 1"), cell.scan(Face::kShow, right, "tile 2")};
  const auto found = register_first_scan(tiles, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_TRUE(found->rms.has_value());
  EXPECT_LT(found->rms->count(), 0.05);
  EXPECT_GT(found->rms->count(), 0.0005);
  EXPECT_EQ(found->fiducials.tags.size(), 5U);
  EXPECT_EQ(found->fiducials.holes.size(), 4U);
  EXPECT_NEAR(found->sheet.width().count(), 230, 0.15);
  EXPECT_LT(error_of(cell, found->tiles[0], left, Face::kShow, found->fiducials).rms, 0.05);
  EXPECT_LT(error_of(cell, found->tiles[1], right, Face::kShow, found->fiducials).rms, 0.05);
}

TEST(ScanMap, UndoesItself) {
  const Cell& cell = warped_cell();
  const auto pose = cell.whole(Face::kBack);
  const calib::ScanMap map(pose.inverse(), cell.model, cell.scanner.nominal());
  for (double x = 3; x < 2000; x += 311)
    for (double y = 3; y < 1500; y += 217) {
      const Point<ScanFrame> p = point<ScanFrame>(x, y);
      EXPECT_LT(distance(map.inverse(map * p), p).count(), 1e-6);
    }
}

}  // namespace
}  // namespace veneer
