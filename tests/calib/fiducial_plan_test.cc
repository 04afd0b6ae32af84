#include "calib/fiducial_plan.h"

#include <gmock/gmock.h>
#include <rapidcheck.h>

#include <rapidcheck/gtest.h>
#include <limits>
#include <set>
#include <utility>

#include "calib/fiducial_sheet.h"
#include "calib/tag_pattern.h"

namespace veneer::calib {
namespace {

using ::testing::HasSubstr;

RC_GTEST_PROP(FiducialPlan, KeepsTagsAndHolesApartInTheRimOfAnyBoard, ()) {
  const double width = *rc::gen::inRange(120, 1500), height = *rc::gen::inRange(120, 1500);
  const auto plan = plan_fiducials(Millimetres(width), Millimetres(height), 120);
  RC_ASSERT(plan.ok());
  std::set<int> ids;
  std::size_t faces[2] = {0, 0};
  for (const PlannedTag& tag : plan->tags) {
    ids.insert(tag.id);
    ++faces[tag.face == Face::kShow ? 0 : 1];
    const double x = tag.centre.x.count(), y = tag.centre.y.count();
    const double edge = std::min({x, y, width - x, height - y});
    RC_ASSERT(edge > kPanelTagSize.count() * 10 / 8 / 2);  // its white rim as well lies on the board
    RC_ASSERT(edge <= kFiducialInset.count() + 0.5);
    for (const auto& hole : plan->holes)
      RC_ASSERT(distance(hole, tag.centre).count() > kPanelHole.count() / 2 + kPanelTagSize.count() * 10 / 8 * 0.7071);
  }
  RC_ASSERT(ids.size() == plan->tags.size());
  RC_ASSERT(*ids.begin() == plan->first_id());
  RC_ASSERT(*ids.rbegin() + 1 == plan->next_id());
  RC_ASSERT(faces[0] == faces[1]);
  RC_ASSERT(faces[0] >= 3U);
  RC_ASSERT(plan->holes.size() == 4U);
  RC_ASSERT(least_difference_of_distances(plan->holes) >= kHoleTell);
}

// Boards that were said to be too small: the first needs its holes chosen among more places than most, and on the
// others, narrow and upright, the long side alone tells holes apart.
TEST(FiducialPlan, FindsRoomOnNarrowBoards) {
  for (const auto& [width, height] : {std::pair{160.0, 383.0}, {160.0, 1287.0}, {120.0, 155.0}})
    EXPECT_TRUE(plan_fiducials(Millimetres(width), Millimetres(height), 0).ok()) << width << " x " << height;
}

TEST(FiducialPlan, TellsWhichDistancesCouldBeMistaken) {
  const auto at = [](double x, double y) { return point<PanelFrame>(x, y); };
  EXPECT_EQ(least_difference_of_distances({at(0, 0), at(10, 0)}).count(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(least_difference_of_distances({at(0, 0), at(10, 0), at(0, 10)}).count(), 0);
  EXPECT_NEAR(least_difference_of_distances({at(0, 0), at(30, 0), at(0, 40)}).count(), 10, 1e-9);
}

TEST(FiducialPlan, RefusesWhatHasNoRoomOrNoTags) {
  const auto small = plan_fiducials(Millimetres(100), Millimetres(300), 120);
  ASSERT_FALSE(small.ok());
  EXPECT_THAT(small.error().message, HasSubstr("100 x 300 mm is too small"));
  const auto late = plan_fiducials(Millimetres(420), Millimetres(280), 580);
  ASSERT_FALSE(late.ok());
  EXPECT_THAT(late.error().message, HasSubstr("ends at 586"));
  EXPECT_FALSE(plan_fiducials(Millimetres(std::numeric_limits<double>::quiet_NaN()), Millimetres(280), 0).ok());
}

TEST(TagPattern, IsARimOfWhiteAroundARimOfBlackAndNoTwoAreAlike) {
  std::set<std::array<std::array<bool, TagPattern::kCells>, TagPattern::kCells>> all;
  for (int id = 0; id < kTagIds; ++id) {
    const auto pattern = tag_pattern(id);
    ASSERT_TRUE(pattern.ok());
    for (std::size_t i = 0; i < TagPattern::kCells; ++i) {
      EXPECT_FALSE(pattern->black[0][i] || pattern->black[i][9]);
      EXPECT_EQ(pattern->black[1][i], i > 0 && i < 9);
    }
    all.insert(pattern->black);
  }
  EXPECT_EQ(all.size(), static_cast<std::size_t>(kTagIds));
  EXPECT_FALSE(tag_pattern(kTagIds).ok());
  EXPECT_FALSE(tag_pattern(-1).ok());
}

TEST(FiducialSheet, HasEveryTagOfThePlanOnceAndAllOnThePaper) {
  for (const auto& [width, height] : {std::pair(420.0, 280.0), std::pair(1500.0, 1000.0), std::pair(160.0, 160.0)}) {
    const auto plan = *plan_fiducials(Millimetres(width), Millimetres(height), 120);
    std::multiset<int> printed;
    std::size_t marks = 0;
    for (const FiducialSheet& page : panel_sheets(plan)) {
      for (const PrintedTag& tag : page.tags) {
        printed.insert(tag.id);
        EXPECT_EQ(tag.size, kPanelTagSize);
      }
      for (const auto& circle : page.circles) marks += circle.diameter == kPanelHole ? 1 : 0;
      for (const auto& line : page.lines)
        for (const auto& p : line.points) {
          EXPECT_GE(std::min(p.x, p.y).count(), 5);
          EXPECT_LE(p.x.count(), page.width.count() - 5);
          EXPECT_LE(p.y.count(), page.height.count() - 5);
        }
    }
    ASSERT_EQ(printed.size(), plan.tags.size());
    for (const PlannedTag& tag : plan.tags) EXPECT_EQ(printed.count(tag.id), 1U);
    EXPECT_GE(marks, plan.holes.size());
  }
}

TEST(FiducialSheet, TheGridIsTheOneThatCalibrationReads) {
  const AprilGrid grid;
  const FiducialSheet sheet = grid_sheet(grid);
  ASSERT_EQ(sheet.tags.size(), static_cast<std::size_t>(grid.tags()));
  const auto origin = sheet.tags.front();
  for (const PrintedTag& tag : sheet.tags) {
    const auto corners = grid.corners(tag.id), first = grid.corners(origin.id);
    EXPECT_NEAR((tag.centre.x - origin.centre.x).count(), (corners[0].x - first[0].x).count(), 1e-9);
    EXPECT_NEAR((tag.centre.y - origin.centre.y).count(), (corners[0].y - first[0].y).count(), 1e-9);
    EXPECT_EQ(tag.size, grid.tag_size);
  }
}

}  // namespace
}  // namespace veneer::calib
