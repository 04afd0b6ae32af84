// Wood that is burnt besides what was planned is written off, and pieces that the beam may have hit are suspect.
#include <gmock/gmock.h>

#include "daemon/unit/broken_run.h"
#include "tests/daemon/unit/proof_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(ProofTest, TheWoodUnderAFrameWithPowerIsWrittenOffOnce) {
  laser_.burn_at_once = true;
  load_first_panel();
  const auto before = live().size();
  ASSERT_TRUE(frame(0).ok());
  EXPECT_EQ(live().size(), before) << "dark";
  ASSERT_TRUE(frame(0.02).ok());
  ASSERT_EQ(live().size(), before + 1);
  EXPECT_EQ(live().back().state, db::AllocationState::kScrap);
  EXPECT_THAT(live().back().reason, HasSubstr("frame"));
  ASSERT_TRUE(frame(0.02).ok());
  EXPECT_EQ(live().size(), before + 1);
}

// However the panel lies, what is written off meets what is booked without overlapping it, rounded as both are.
TEST_F(ProofTest, TheWoodUnderAFrameEndsWhereThatOfItsPiecesBegins) {
  laser_.burn_at_once = true;
  load_first_panel();
  for (int i = 0; i < 24; ++i) {
    bed_.seen = ProvenPose{PanelId{"P-0001"}, true,
                           Isometry2<BedFrame, PanelFrame>(
                               degrees(1.37 * i), point<BedFrame>(30 + 0.613 * i, 0.219 * i), Handedness::kImproper),
                           Millimetres(0.02)};
    look();
    const Status traced = frame(0.02);
    EXPECT_TRUE(traced.ok()) << i << ": " << traced.error().message;
  }
}

TEST_F(ProofTest, AFrameWithPowerOverWoodThatIsKeptForAPieceIsRefused) {
  laser_.burn_at_once = true;
  load_first_panel();
  const Status other = database_->call([](Repositories& r) -> Status {
    db::NewPlan job;
    job.name = "other";
    job.plan_json = job.options_json = "{}";
    db::PlannedPatch& piece = job.pieces.emplace_back();
    piece.mark = "B7-1";
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(20, 0), point<ArtworkFrame>(20, 20)};
    piece.panel = PanelId{"P-0001"};
    piece.panel_outline = {point<PanelFrame>(80, 0), point<PanelFrame>(100, 0), point<PanelFrame>(100, 20)};
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.27));
    job.planned_on = {{PanelId{"P-0001"}, 1}};
    auto id = r.jobs.create(job, kThen);
    return id ? Ok() : Status(id.error());
  });
  ASSERT_TRUE(other.ok()) << other.error().message;
  // The hull, 10 to 20 in the machine, lies over 90 to 100 of the panel.
  bed_.lay("P-0001", true, 110, 10);
  look();
  const auto before = live().size();
  EXPECT_THAT(frame(0.02).error().message, AllOf(HasSubstr("piece B7-1 of job 2"), HasSubstr("dark")));
  EXPECT_EQ(starts(), 0);
  EXPECT_EQ(live().size(), before);
  EXPECT_TRUE(frame(0).ok());
}

TEST_F(ProofTest, AnAbortOffThePathMakesTheNeighboursSuspect) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);  // machine x = 100 - panel x
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  // Astray over the second piece's wood, 20 to 30 of the panel.
  go_astray(95, 78);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), AllOf(HasSubstr("off its path"), HasSubstr("1 piece(s) beside it")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_EQ(runner_->view().job->suspect, 2);
}

// An operator who sees the head leave its path presses STOP before the driver has made up its mind.
TEST_F(ProofTest, AStopOffThePathMakesTheNeighboursSuspectAsWell) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.stray_path = {point<MachineFrame>(95, 2), point<MachineFrame>(78, 2)};
  laser_.stray_reach = Millimetres(1);
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), AllOf(HasSubstr("STOP"), HasSubstr("1 piece(s) beside it")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(ProofTest, AnAbortOffThePathWritesOffTheFreeWoodThatItMayHaveHit) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  const auto before = live().size();
  go_astray(60, 45);  // 40 to 55 of the panel, which is nobody's
  ASSERT_EQ(live().size(), before + 1);
  EXPECT_EQ(live().back().state, db::AllocationState::kScrap);
  EXPECT_THAT(live().back().reason, HasSubstr("strayed"));
  const auto box = bounds(live().back().area.rings().front());
  EXPECT_LT(box.min.x, Millimetres(39.1));  // 1 mm beyond, and half a kerf
  EXPECT_GT(box.max.x, Millimetres(55.9));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

TEST_F(ProofTest, AnAbortOffThePathEndsALeaseOfTheWoodThatItMayHaveHit) {
  load_first_panel();
  const Status leased = database_->call([](Repositories& r) -> Status {
    db::NewPlan plan;
    plan.name = "later";
    plan.plan_json = plan.options_json = "{}";
    db::PlannedPatch& piece = plan.pieces.emplace_back();
    piece.mark = "B7-1";
    piece.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(20, 0), point<ArtworkFrame>(20, 20)};
    piece.panel = PanelId{"P-0001"};
    piece.panel_outline = {point<PanelFrame>(80, 0), point<PanelFrame>(100, 0), point<PanelFrame>(100, 20)};
    piece.allocation = offset(Region<PanelFrame>(piece.panel_outline), Millimetres(0.27));
    plan.planned_on = {{PanelId{"P-0001"}, 1}};
    auto id = r.plans.add(plan, kThen);
    if (!id) return id.error();
    auto lease = r.leases.take(*id, "uid 1000", utc_timestamp(), "2099-01-01T00:00:00.000Z");
    return lease ? Ok() : Status(lease.error());
  });
  ASSERT_TRUE(leased.ok()) << leased.error().message;
  const auto is_leased = [](const auto& all) {
    return std::ranges::any_of(all, [](const auto& a) { return a.state == db::AllocationState::kLeased; });
  };
  ASSERT_TRUE(is_leased(live()));
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  go_astray(18, 2);  // 82 to 98 of the panel
  EXPECT_FALSE(is_leased(live()));
  EXPECT_EQ(live().back().state, db::AllocationState::kScrap) << "and it is nobody's to take";
}

// Or every later Start would say that the run is on.
TEST_F(ProofTest, ARunEndsThoughNothingCanBeWrittenOff) {
  begin();
  BrokenRun broken;
  broken.id = (*database_->call([](Repositories& r) { return r.jobs.last_run(); }))->id;
  broken.pose.panel = PanelId{"P-9999"};
  broken.stray_path = {point<MachineFrame>(2, 2), point<MachineFrame>(9, 2)};
  broken.stray_reach = Millimetres(1);
  broken.reason = "the laser is off its path";
  const auto written = database_->call([&](Repositories& r) { return write_down(r, broken, kThen); });
  EXPECT_TRUE(written.ok()) << written.error().message;
  EXPECT_TRUE((*database_->call([](Repositories& r) { return r.jobs.last_run(); }))->ended_at);
}

TEST_F(ProofTest, AnAbortOffThePathReachesNoFartherThanItSays) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  go_astray(95, 85);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
}

TEST_F(ProofTest, ACutNeighbourBecomesSuspectAsWell) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.finish();
  settle();
  ASSERT_EQ(starts(), 2);
  go_astray(78, 95);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(ProofTest, ARecutOffThePathMakesWhatItMayHaveHitSuspect) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  for (int piece = 0; piece < 2; ++piece) laser_.finish(), settle();
  ASSERT_EQ(state(), CellState::kSuspended);
  static_cast<void>(recut({"A1-1"}));
  ASSERT_EQ(starts(), 3);
  go_astray(95, 78);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(reason(), AllOf(HasSubstr("A1-1 was being cut again"), HasSubstr("2 piece(s) beside it")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_EQ(runner_->view().job->suspect, 2);
}

TEST_F(ProofTest, AFrameWithPowerOffThePathMakesWhatItMayHaveHitSuspect) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  static_cast<void>(frame(0.02));
  go_astray(79, 72);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kSuspect, P::kReserved));
}

TEST_F(ProofTest, ADarkFrameOffThePathHitsNothing) {
  load_first_panel();
  bed_.lay("P-0001", true, 100, 0);
  look();
  static_cast<void>(frame(0));
  go_astray(79, 72);
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
}

}  // namespace
}  // namespace veneer::daemon
