// The web of wood that curved borders need around each piece.
#include "daemon/plans/plan_web.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "daemon/routes/cell_json.h"
#include "planner/cutting/lead_choice.h"
#include "tests/support/stocked_planner.h"

namespace veneer::daemon {
namespace {

using PlanWebTest = testing::StockedPlanner;

TEST_F(PlanWebTest, APlanWithRefinedBordersKeepsAWebOfWoodAroundEachPiece) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto job = plan(refined_job());
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_GT(to_json(*job)["refined"]["cost_before"], to_json(*job)["refined"]["cost"]);
  const auto live = database_->call([](Repositories& r) { return r.ledger.live_allocations(PanelId{"P-0001"}); });
  ASSERT_EQ(live->size(), 4U);
  bool curved = false;
  for (const auto& one : *live) {
    curved = curved || one.outline.size() > 8;
    const Region<PanelFrame> webbed = offset(one.area, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& other : *live) EXPECT_TRUE(one.id == other.id || !overlaps(webbed, other.area));
  }
  EXPECT_TRUE(curved);
  // Straight ones may touch.
  const auto straight = stored_plan(small_job());
  ASSERT_TRUE(straight.ok()) << straight.error().message;
  EXPECT_TRUE(to_json(*straight)["refined"].is_null());
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(straight->plan); });
  EXPECT_EQ(nlohmann::json::parse(kept->options_json)["web_mm"], 0);
}

// A mosaic's borders are curved without being refined.
TEST_F(PlanWebTest, AMosaicKeepsAWebOfWoodAroundEachPiece) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  JobRequest request = refined_job();
  request.options.refine = planner::Refine::kNone;
  request.options.layout = planner::LayoutKind::kMosaic;
  const auto stored = stored_plan(request);
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(stored->plan); });
  EXPECT_EQ(nlohmann::json::parse(kept->options_json)["web_mm"], planner::kPieceWeb.count());
  const auto pieces = database_->call([&](Repositories& r) { return r.plans.patches(stored->plan); });
  ASSERT_GT(pieces->size(), 1U);
  for (const auto& piece : *pieces) {
    ASSERT_TRUE(piece.panel);
    const Region<PanelFrame> webbed = offset(piece.allocation, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& other : *pieces)
      EXPECT_TRUE(other.mark == piece.mark || !overlaps(webbed, other.allocation)) << piece.mark << " " << other.mark;
  }
}

TEST_F(PlanWebTest, APlanIsNoJobWhenOtherWoodCameNearerThanItsWeb) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto stored = stored_plan(refined_job());
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  const auto pieces = database_->call([&](Repositories& r) { return r.plans.patches(stored->plan); });
  const auto kept = database_->call([&](Repositories& r) { return r.plans.find(stored->plan); });
  const auto keeps = [&] {
    return database_->call([&](Repositories& r) { return keeps_web(r, kept->options_json, *pieces); });
  };
  EXPECT_TRUE(keeps().ok());
  Millimetres right{0};
  for (const auto& piece : *pieces)
    for (const auto& ring : piece.allocation.rings())
      for (const auto& p : ring) right = std::max(right, p.x);
  const auto write_off = [&](Millimetres from) {
    const Ring<PanelFrame> strip{{from, 0_mm}, {from + 1_mm, 0_mm}, {from + 1_mm, 34_mm}, {from, 34_mm}};
    return database_->call([&](Repositories& r) {
      return r.ledger.write_off(PanelId{"P-0001"}, Region<PanelFrame>(strip), "test", "2026-01-01T00:00:00.000Z");
    });
  };
  ASSERT_TRUE(write_off(right + 1.4_mm).ok());
  EXPECT_TRUE(keeps().ok());
  ASSERT_TRUE(write_off(right + 0.1_mm).ok());
  ASSERT_FALSE(keeps().ok());
  EXPECT_EQ(keeps().error().code, ErrorCode::kConflict);
  EXPECT_THAT(keeps().error().message, ::testing::HasSubstr("less than 0.2 mm of wood"));
}

TEST_F(PlanWebTest, ARefinedPlanIsChangedWithItsWeb) {
  add_panel("P-0001", 255, planner::test::wood_picture(400, 400, 7));
  const auto stored = stored_plan(refined_job());
  ASSERT_TRUE(stored.ok()) << stored.error().message;
  PlanService::Change change;
  change.plan = stored->plan;
  change.edits.replanned = {"A1-1"};
  change.threads = 1;
  const auto after = changed(change);
  ASSERT_TRUE(after.ok()) << after.error().message;
  const auto before = pieces_of(stored->plan), now = pieces_of(after->plan);
  for (const auto& [mark, piece] : now) {
    EXPECT_EQ(piece.artwork_outline, before.at(mark).artwork_outline) << mark;
    const Region<PanelFrame> webbed = offset(piece.allocation, planner::kPieceWeb - Millimetres(0.01), Corners::kRound);
    for (const auto& [other, its] : now) EXPECT_TRUE(mark == other || !overlaps(webbed, its.allocation));
  }
}

}  // namespace
}  // namespace veneer::daemon
