// The back of a panel, tied to its show face by the holes, and what only looks like it.
#include <gmock/gmock.h>

#include "tests/calib/scanned_panel.h"

namespace veneer {
namespace {

using calib::PanelFiducials;
using calib::TileView;
using scanned::Cell;
using scanned::plain_cell;
using scanned::plain_fiducials;
using scanned::plain_show;
using scanned::warped_cell;

TEST(Registration, TiesTheBackToTheShowFaceByItsHoles) {
  const Cell& cell = warped_cell();
  const TileView show[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto known = register_first_scan(show, cell.model);
  ASSERT_TRUE(known.ok()) << known.error().message;
  const auto pose = cell.whole(Face::kBack, 181);
  const TileView back[] = {cell.scan(Face::kBack, pose)};
  const auto found = register_scan(back, Face::kBack, known->fiducials, cell.model);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_LT(found->rms->count(), 0.05);
  EXPECT_EQ(found->tiles[0].panel_from_glass().handedness(), Handedness::kImproper);
  EXPECT_EQ(found->fiducials.tags.size(), 10U);
  // Both faces agree: after the best isometry on the show face's tags, the back's tags are where they are.
  std::vector<Point<PanelFrame>> is, seems;
  double worst = 0;
  for (const auto& tag : cell.panel.tags)
    for (std::size_t i = 0; tag.face == Face::kShow && i < 4; ++i)
      is.push_back(tag.corners()[i]), seems.push_back(found->fiducials.tag(tag.id)->corners[i]);
  const auto true_from_found = calib::fit_isometry<PanelFrame, PanelFrame>(is, seems);
  for (const auto& tag : cell.panel.tags)
    for (std::size_t i = 0; tag.face == Face::kBack && i < 4; ++i)
      worst = std::max(worst,
                       distance(true_from_found * found->fiducials.tag(tag.id)->corners[i], tag.corners()[i]).count());
  EXPECT_LT(worst, 0.08);
  // A second look at the back fits its frozen tags.
  const TileView again[] = {cell.scan(Face::kBack, cell.whole(Face::kBack, 2))};
  const auto second = register_scan(again, Face::kBack, found->fiducials, cell.model);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(second->fiducials.tags.size(), 10U);
}

// The second trap: a panel whose tags were printed turned by 180 degrees is self-consistent, and so is its map. But it
// is not what the frozen fiducials say.
TEST(Registration, RefusesTagsTurnedByHalfAgainstTheFrozenOnes) {
  Cell cell;
  const PanelFiducials known = plain_fiducials();
  for (auto& tag : cell.panel.tags) tag.upside_down = true;
  const TileView turned[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto found = register_scan(turned, Face::kShow, known, cell.model);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::kRefused);
}

// The third trap: the back must be mirrored, and that is measured.
TEST(Registration, RefusesTheWrongFace) {
  const Cell& cell = plain_cell();
  const TileView show[] = {plain_show()};
  const PanelFiducials known = plain_fiducials();
  const auto wrong = register_scan(show, Face::kBack, known, cell.model);
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, ::testing::HasSubstr("show face lies on the glass"));

  // A "back" whose holes lie as on the show face is no back.
  TileView fake = show[0];
  for (auto& tag : fake.tags) tag.id += 20;
  const auto unmirrored = register_scan(std::span(&fake, 1), Face::kBack, known, cell.model);
  ASSERT_FALSE(unmirrored.ok());
  EXPECT_THAT(unmirrored.error().message, ::testing::HasSubstr("not mirrored"));
}

TEST(Registration, RefusesSymmetricHolesAndTooFew) {
  Cell cell;
  cell.panel.holes = {{40, 7}, {110, 7}, {40, 103}, {110, 103}};
  const TileView show[] = {cell.scan(Face::kShow, cell.whole(Face::kShow))};
  const auto known = register_first_scan(show, cell.model);
  ASSERT_TRUE(known.ok());
  const TileView back[] = {cell.scan(Face::kBack, cell.whole(Face::kBack))};
  const auto symmetric = register_scan(back, Face::kBack, known->fiducials, cell.model);
  ASSERT_FALSE(symmetric.ok());
  EXPECT_THAT(symmetric.error().message, ::testing::HasSubstr("symmetry"));
  PanelFiducials few = known->fiducials;
  few.holes.resize(2);
  const auto starved = register_scan(back, Face::kBack, few, cell.model);
  ASSERT_FALSE(starved.ok());
  EXPECT_THAT(starved.error().message, ::testing::HasSubstr("fewer than 3"));
}

}  // namespace
}  // namespace veneer
