#include "db/plans.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"

namespace veneer::db {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlansTest : public ::testing::Test {
 protected:
  CellDatabase cell;
  PanelId panel = cell.new_panel(), other = cell.new_panel();
  Plans plans{cell.database()};
  NewPlan two_pieces() {
    return job_of({square_piece("A1", panel, 10, 10, 14), square_piece("A2", other, 30, 10, 14)});
  }
};

TEST_F(PlansTest, AreKeptAsTheyWereMade) {
  NewPlan plan = two_pieces();
  plan.who = "local:1000", plan.preview_file = "p.png", plan.report_json = "{\"cost_per_pixel\":0.01}";
  plan.pieces[0].lead_in = point<PanelFrame>(9.5, 9.5);
  PlannedPatch gap = square_piece("A3", panel, 0, 0, 14);
  gap.panel.reset(), gap.panel_outline.clear(), gap.allocation = {};
  plan.pieces.push_back(gap);
  const PlanId id = must(plans.add(plan, kNow));
  const PlanRecord found = must(plans.find(id));
  EXPECT_EQ(found.name, "portrait");
  EXPECT_EQ(found.who, "local:1000");
  EXPECT_EQ(found.created_at, kNow);
  EXPECT_EQ(found.preview_file, "p.png");
  EXPECT_EQ(found.report_json, plan.report_json);
  EXPECT_EQ(found.parent, std::nullopt);
  EXPECT_EQ(found.patches, 3);
  EXPECT_EQ(found.placed, 2);
  EXPECT_THAT(found.panels, ElementsAre(PlannedPanel{panel, 1}, PlannedPanel{other, 1}));
  EXPECT_THAT(found.outdated, IsEmpty());
  EXPECT_THAT(found.jobs, IsEmpty());
  EXPECT_EQ(must(plans.plan_json(id)), plan.plan_json);
  const auto patches = must(plans.patches(id));
  ASSERT_EQ(patches.size(), 3U);
  EXPECT_EQ(patches[0].mark, "A1");
  EXPECT_EQ(patches[0].artwork_outline, plan.pieces[0].artwork_outline);
  EXPECT_EQ(patches[0].panel_outline, plan.pieces[0].panel_outline);
  EXPECT_EQ(patches[0].allocation.area(), plan.pieces[0].allocation.area());
  EXPECT_EQ(patches[0].lead_in, plan.pieces[0].lead_in);
  EXPECT_EQ(patches[1].panel, other);
  EXPECT_EQ(patches[1].panel_from_artwork.shift(), plan.pieces[1].panel_from_artwork.shift());
  EXPECT_EQ(patches[2].panel, std::nullopt);
}

TEST_F(PlansTest, HoldNoWoodUntilAJobIsMade) {
  const PlanId first = must(plans.add(two_pieces(), kNow)), second = must(plans.add(two_pieces(), kNow));
  EXPECT_THAT(must(cell.ledger().live_allocations(panel)), IsEmpty());
  const JobId job = must(cell.jobs().create(first, kLater));
  EXPECT_EQ(must(cell.jobs().find(job)).plan, first);
  EXPECT_EQ(must(cell.jobs().find(job)).count(PieceState::kReserved), 2);
  EXPECT_THAT(must(plans.find(first)).jobs, ElementsAre(job));
  EXPECT_THAT(must(plans.taken(second)), ElementsAre("A1", "A2"));
  const auto refused = cell.jobs().create(second, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_THAT(refused.error().message, HasSubstr("piece A1"));
  EXPECT_EQ(must(cell.jobs().list()).size(), 1U);
  // Given up, its wood is free for the other plan, and for the same once more.
  VENEER_ASSERT_OK(cell.jobs().cancel(job, kLater));
  EXPECT_THAT(must(plans.taken(second)), IsEmpty());
  const JobId again = must(cell.jobs().create(first, kLater));
  EXPECT_NE(must(cell.jobs().pieces(again))[0].id, must(cell.jobs().pieces(job))[0].id);
}

TEST_F(PlansTest, OfAPanelThatWasScannedAgainMakeNoJob) {
  const PlanId plan = must(plans.add(two_pieces(), kNow));
  must(cell.panels().add_mask(other, {0, "map", "mask", "hash", kLater}, 1));
  EXPECT_THAT(must(plans.find(plan)).outdated, ElementsAre(other));
  const auto refused = cell.jobs().create(plan, kLater);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(refused.error().message,
            "panel P-0002 was scanned again after this was planned, or a scan was taken back: plan again");
}

TEST_F(PlansTest, KnowThePlanTheyCameFrom) {
  const PlanId first = must(plans.add(two_pieces(), kNow));
  NewPlan changed = two_pieces();
  changed.parent = first;
  const PlanId second = must(plans.add(changed, kLater));
  EXPECT_EQ(must(plans.find(second)).parent, first);
  EXPECT_EQ(must(plans.list()).at(0).id, second);
  EXPECT_EQ(plans.remove(first).error().code, ErrorCode::kConflict);
  VENEER_EXPECT_OK(plans.remove(second));
  VENEER_EXPECT_OK(plans.remove(first));
  EXPECT_THAT(must(plans.list()), IsEmpty());
}

TEST_F(PlansTest, OfAJobStay) {
  const PlanId plan = must(plans.add(two_pieces(), kNow));
  must(cell.jobs().create(plan, kNow));
  const Status refused = plans.remove(plan);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kConflict);
  EXPECT_EQ(cell.jobs().create(PlanId{99}, kNow).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(plans.find({99}).error().code, ErrorCode::kNotFound);
}

TEST_F(PlansTest, AJobThatCannotBeMadeLeavesNoPlanOfItsOwn) {
  must(cell.jobs().create(two_pieces(), kNow));
  EXPECT_FALSE(cell.jobs().create(two_pieces(), kNow).ok());
  EXPECT_EQ(must(plans.list()).size(), 1U);
}

}  // namespace
}  // namespace veneer::db
