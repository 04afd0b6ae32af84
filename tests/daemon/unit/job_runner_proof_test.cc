// A proof of the pose holds until the lid opens or a hand could have been in; wood that is burnt besides is accounted
// for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/unit/job_words.h"
#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using P = db::PieceState;

class ProofTest : public JobRunnerTest {
 protected:
  void SetUp() override {
    JobRunnerTest::SetUp();
    laser_.burn_at_once = false;
  }
  // The first piece of two is being burnt.
  void begin() {
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_EQ(starts(), 1);
  }
  // The head is seen to go from x to x along y = 2 of the machine, each known to 1 mm.
  void go_astray(double from, double to) {
    laser_.fail({ErrorCode::kDeviceFault, "the laser is off its path"},
                {point<MachineFrame>(from, 2), point<MachineFrame>(to, 2)}, Millimetres(1));
    settle();
  }
  std::string reason() const { return runner_->view().reason; }
  std::vector<db::AllocationRecord> live(const char* panel = "P-0001") {
    auto found = database_->call([&](Repositories& r) { return r.ledger.live_allocations(PanelId{panel}); });
    return *found;
  }
};

// ---- From Unsuspend to the first stroke --------------------------------------------------------------------------

TEST_F(ProofTest, ALidOpenedWhileTheCameraLooksMakesThePictureWorthNothing) {
  load_first_panel();
  std::optional<Status> unsuspended;
  runner_->command(CellCommand::kUnsuspend, "test", [&](Status s) { unsuspended = std::move(s); });
  laser_.open_and_close_lid();  // the picture is taken, and now the panel is nudged
  bed_.lay("P-0001", true, 303.4);
  settle();
  ASSERT_TRUE(unsuspended);
  ASSERT_FALSE(unsuspended->ok());
  EXPECT_THAT(unsuspended->error().message, HasSubstr("lid was opened"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), 0);
}

TEST_F(ProofTest, APictureTakenUnderAnOpenLidProvesNothing) {
  load_first_panel();
  laser_.open_lid();
  std::optional<Status> unsuspended;
  runner_->command(CellCommand::kUnsuspend, "test", [&](Status s) { unsuspended = std::move(s); });
  bed_.lay("P-0001", true, 303.4);
  laser_.close_lid();  // the opening was counted before the picture, the hands were in after it
  settle();
  ASSERT_TRUE(unsuspended);
  EXPECT_FALSE(unsuspended->ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), 0);
}

TEST_F(ProofTest, ALidOpenedBetweenTheProofAndTheFirstStrokeHolds) {
  load_first_panel();
  bed_.on_prepare = [this] {
    laser_.open_and_close_lid();
    bed_.lay("P-0001", true, 303.4);
  };
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), HasSubstr("lid was opened"));
  EXPECT_EQ(starts(), 0);
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, AllOf(HasSubstr("panel P-0001 moved by 3.40 mm"), HasSubstr("Unhold")));
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 0);
  // Nothing was begun, so the panel can be proven anew from the start.
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
}

TEST_F(ProofTest, ALidOpenedAfterThePieceWasNotedHolds) {
  load_first_panel();
  std::optional<SlowDatabase> slow;
  bed_.on_prepare = [&] {
    if (state() == CellState::kUnsuspending) slow.emplace(*database_);
  };
  runner_->command(CellCommand::kUnsuspend, "test", [](const Status&) {});
  poll();
  ASSERT_TRUE(slow);
  slow.reset();
  while (state() != CellState::kExecute) turn();
  laser_.open_and_close_lid();  // its note is on the way to the disk
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 0);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 1);
}

TEST_F(ProofTest, TheLidThroughWhichThePanelWasLaidUndoesNothing) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  laser_.open_and_close_lid();
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kExecute);
  EXPECT_EQ(starts(), 1);
}

// ---- From Held to Unhold -----------------------------------------------------------------------------------------

TEST_F(ProofTest, UnholdLooksAgainAndRefusesAPanelThatMovedUnderAHeldPiece) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  bed_.lay("P-0001", true, 300.4);
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_THAT(unheld.error().message, HasSubstr("moved by 0.40 mm since its first piece was begun"));
  EXPECT_EQ(reason(), unheld.error().message);
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(laser_.calls, Not(Contains("resume")));
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("no panel is on the bed"));
  bed_.lay("P-0002");
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  bed_.lay("P-0001", true, 300.05);  // laid back, as well as hands can
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_THAT(laser_.calls, Contains("resume"));
}

TEST_F(ProofTest, UnholdLooksBetweenTwoPiecesAsWell) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  const int looks = bed_.looks;
  laser_.finish();
  laser_.on_hold = tests::SimLaser::OnHold::kNothing;
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  bed_.lay("P-0001", true, 299);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 1);
}

TEST_F(ProofTest, ALidOpenedWhileUnholdLooksHoldsOn) {
  begin();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  std::optional<Status> unheld;
  runner_->command(CellCommand::kUnhold, "test", [&](Status s) { unheld = std::move(s); });
  laser_.open_and_close_lid();
  settle();
  ASSERT_TRUE(unheld);
  EXPECT_FALSE(unheld->ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(laser_.calls, Not(Contains("resume")));
}

// ---- Every so many pieces ----------------------------------------------------------------------------------------

class LookEveryPiece : public ProofTest {
 protected:
  void SetUp() override {
    ProofTest::SetUp();
    options_.look_every = 1;
    make_runner();
  }
};

TEST_F(LookEveryPiece, TheCameraLooksAgainAndTheRunGoesOn) {
  begin();
  const int looks = bed_.looks;
  laser_.finish();
  settle();
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 2);
  EXPECT_EQ(state(), CellState::kExecute);
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kSuspended);
}

// A camera that is a file would show the first proof's picture for ever.
TEST_F(LookEveryPiece, EachLookWantsAPictureFromAfterTheLastProof) {
  begin();
  const int told = bed_.hands;
  laser_.finish();
  settle();
  ASSERT_EQ(starts(), 2);
  EXPECT_EQ(bed_.hands, told + 1);
}

TEST_F(LookEveryPiece, APanelThatCreptHoldsTheRunBeforeItsNextPiece) {
  begin();
  bed_.lay("P-0001", true, 300.5);
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), AllOf(HasSubstr("moved by 0.50 mm"), HasSubstr("piece A1-1 was cut since")));
  EXPECT_EQ(starts(), 1);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved)) << "before it crept, or after?";
}

// What was proven by a look is not put in doubt by a later one.
TEST_F(LookEveryPiece, OnlyPiecesSinceTheLastProofAreInDoubt) {
  begin();
  laser_.finish();
  settle();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kSuspect, P::kReserved));
}

// ---- Before the end ----------------------------------------------------------------------------------------------

// A job of fewer pieces than RunnerOptions::look_every.
TEST_F(ProofTest, APanelThatWasLiftedInMidCutLeavesItsPiecesSuspect) {
  begin();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(reason(), AllOf(HasSubstr("no panel is on the bed"), HasSubstr("pieces A1-1, A1-2 were cut since"),
                              HasSubstr("bare bed")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
  EXPECT_EQ(runner_->view().job->suspect, 2);
  EXPECT_EQ(runner_->view().job->cut, 0);
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(job_state(), db::JobState::kStopped);
  EXPECT_THAT(next_words(runner_->view(), {}),
              "0 of 3 pieces of job 1 are cut, 2 are suspect and 1 is still to be cut: Reset, look at the suspect "
              "pieces and say what became of each (veneerctl job settle 1), then Start cuts the rest (veneerctl job "
              "start 1)");
}

TEST_F(ProofTest, HandsThatComeThroughTheLidForTheLastPieceMakeNothingSuspect) {
  begin();
  laser_.finish();
  settle();
  laser_.finish();
  laser_.open_lid();
  bed_.seen = Error{ErrorCode::kNotFound, "no panel is on the bed"};
  settle();
  EXPECT_EQ(state(), CellState::kSuspended) << "for the second panel";
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, ACameraThatDoesNotAnswerAtTheEndIsWaitedForUntilTheOperatorEndsIt) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_THAT(reason(), HasSubstr("2 pieces are suspect"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(ProofTest, ACameraThatIsBackProvesWhatWasCut) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kHeld);
  bed_.lay("P-0001");
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(ProofTest, StopInsteadOfALookThatIsOwedLeavesThePiecesSuspect) {
  begin();
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera is gone"};
  laser_.finish();
  settle();
  laser_.finish();
  settle();
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kSuspect, P::kReserved));
}

TEST_F(LookEveryPiece, HoldWhileTheCameraLooksHolds) {
  begin();
  laser_.finish();
  while (runner_->view().job->cut < 1) {  // booked, and the look is asked for
    database_->call([](Repositories&) { return 0; });
    turn();
  }
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 2);
}

TEST_F(LookEveryPiece, TheHeadLeavesThePictureFirst) {
  laser_.can_jog = true;
  begin();
  laser_.position = point<MachineFrame>(15, 20);
  const int looks = bed_.looks;
  laser_.finish();
  settle();
  EXPECT_EQ(laser_.calls.back(), "jog");
  EXPECT_EQ(bed_.looks, looks) << "the head is still in the picture";
  EXPECT_EQ(starts(), 1);
  laser_.end_jog();
  settle();
  EXPECT_EQ(laser_.position, point<MachineFrame>(0, 0)) << "where it stood after homing";
  EXPECT_EQ(bed_.looks, looks + 1);
  EXPECT_EQ(starts(), 2);
}

TEST_F(LookEveryPiece, HoldOnTheHeadsWayOutOfThePictureHolds) {
  laser_.can_jog = true;
  begin();
  laser_.position = point<MachineFrame>(15, 20);
  laser_.finish();
  settle();
  ASSERT_EQ(laser_.calls.back(), "jog");
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(laser_.calls.back(), "stop_jog");
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
}

TEST_F(LookEveryPiece, TheHeadNeverCrossesAForbiddenZoneForIt) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(4, 4));
  clamp.add(point<MachineFrame>(6, 30));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  laser_.can_jog = true;
  laser_.position = point<MachineFrame>(8, 8);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.position = point<MachineFrame>(15, 20);  // home is behind the clamp
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  const int looks = bed_.looks;
  laser_.position = point<MachineFrame>(8, 8);
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.position = point<MachineFrame>(3, 20);
  laser_.finish();
  settle();
  EXPECT_THAT(laser_.calls, Not(Contains("jog")));
  EXPECT_EQ(bed_.looks, looks + 2);
}

// ---- Wood that is burnt besides ----------------------------------------------------------------------------------

class PatternTest : public ProofTest {
 protected:
  static LaserJob pattern(double power) {
    Stroke stroke;
    stroke.role = StrokeRole::kPattern;
    stroke.path = {point<MachineFrame>(10, 10), point<MachineFrame>(50, 10)};
    stroke.speed = MmPerSecond(10);
    stroke.power = PowerFraction(power);
    return {{stroke}};
  }
  Status burn(double power, std::vector<std::string> confirmed = {}) {
    std::optional<Status> out;
    runner_->burn_pattern(
        pattern(power), "test", [&](Status s) { out = std::move(s); }, std::move(confirmed));
    settle();
    if (laser_.burning()) laser_.finish(), settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }
};

TEST_F(PatternTest, IsRefusedWhileAPanelOfTheStockIsInSight) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  const Status burnt = burn(0.2);
  ASSERT_FALSE(burnt.ok());
  EXPECT_THAT(burnt.error().message, AllOf(HasSubstr("panel P-0001 of the stock"), HasSubstr("take it off")));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(starts(), 0);
  bed_.stock = StockSight{};
  EXPECT_TRUE(burn(0.2).ok());
  EXPECT_EQ(starts(), 1);
}

// A calibration looks at the bed for seconds before it burns on what was said when it was asked for.
TEST_F(PatternTest, AWordGivenEarlierEndsWithTheLidAndWithTheState) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  const auto before = runner_->consent();
  EXPECT_TRUE(runner_->still_holds(before).ok());
  laser_.open_lid();
  const Status open = runner_->still_holds(before);
  ASSERT_FALSE(open.ok());
  EXPECT_EQ(open.error().code, ErrorCode::kRefused);
  EXPECT_THAT(open.error().message, HasSubstr("the lid was opened"));
  laser_.close_lid();
  EXPECT_FALSE(runner_->still_holds(before).ok()) << "hands were in";

  const auto closed = runner_->consent();
  EXPECT_TRUE(runner_->still_holds(closed).ok());
  ASSERT_TRUE(burn(0).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());  // and back to Idle, with the lid shut
  ASSERT_EQ(state(), CellState::kIdle);
  const Status elsewhere = runner_->still_holds(closed);
  ASSERT_FALSE(elsewhere.ok());
  EXPECT_THAT(elsewhere.error().message, AllOf(HasSubstr("went on to something else"), HasSubstr("ask for it again")));
}

TEST_F(PatternTest, WhereStockMayLieUnseenAPersonSaysThatItIsScrap) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = StockSight{{}, {"tag 300 of no known panel is in sight"}};
  const Status burnt = burn(0.2);
  ASSERT_FALSE(burnt.ok());
  EXPECT_THAT(burnt.error().message,
              AllOf(HasSubstr("tag 300 of no known panel"), HasSubstr("--confirm \"scrap on the bed\"")));
  EXPECT_EQ(starts(), 0);
  EXPECT_TRUE(burn(0, {}).ok()) << "dark";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_TRUE(burn(0.2, {"scrap on the bed"}).ok());
  const auto audit = database_->call([](Repositories& r) { return r.audit.latest(1); });
  ASSERT_TRUE(audit.ok());
  ASSERT_FALSE(audit->empty());
  EXPECT_THAT(audit->front().detail, HasSubstr("scrap on the bed"));
  // A tag that is known is no doubt, and nobody's word weighs against it.
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  EXPECT_THAT(burn(0.2, {"scrap on the bed"}).error().message, HasSubstr("panel P-0001 of the stock"));
}

TEST_F(PatternTest, IsRefusedWhenNobodyCanTell) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = Error{ErrorCode::kUnavailable, "the camera does not answer"};
  EXPECT_THAT(burn(0.2).error().message, HasSubstr("the camera does not answer"));
  EXPECT_EQ(starts(), 0);
}

TEST_F(PatternTest, SaysWhatTheMachineRemarked) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.remark = "the lid was opened over it";
  EXPECT_TRUE(burn(0.2).ok());
  EXPECT_EQ(reason(), "the pattern is burnt; the lid was opened over it");
}

TEST_F(PatternTest, RunsDarkOverAnything) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  EXPECT_TRUE(burn(0).ok());
  EXPECT_EQ(starts(), 1);
  EXPECT_EQ(bed_.looks, 0);
  EXPECT_THAT(reason(), HasSubstr("beam off"));
}

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

TEST(BrokenRun, IsNotWrittenWhileTheDatabaseIsBusyOrTheDiskFull) {
  EXPECT_FALSE(is_written(Error{ErrorCode::kUnavailable, "the database is busy: another program holds it"}));
  EXPECT_FALSE(is_written(Error{ErrorCode::kStorage, "the disk is full"}));
  EXPECT_FALSE(is_written(Error{ErrorCode::kInternal, "out of memory"}));
  EXPECT_TRUE(is_written(Error{ErrorCode::kConflict, "run 7 is not on"}));
  EXPECT_TRUE(is_written(3));
}

}  // namespace
}  // namespace veneer::daemon
