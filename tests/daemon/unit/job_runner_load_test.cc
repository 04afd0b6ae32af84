// What is checked, confirmed and shown before the beam comes on; cutting again; several set-ups.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using P = db::PieceState;

// ---- Before motion -----------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, AJobThatLeavesTheTravelIsRefusedBeforeAnythingMoves) {
  bed_.reach_x = 530;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  EXPECT_FALSE(runner_->view().load->found);
  EXPECT_THAT(sentence(), HasSubstr("10.0 mm at the right side: move the panel to the left"));
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("right side"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, AMachineThatFindsNoHomeCutsNoJob) {
  laser_.finds_home = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_THAT(start().error().message, HasSubstr("homing switches"));
  EXPECT_EQ(state(), CellState::kIdle);
}

// A hole where a piece is to be cut, and a panel that nobody has looked at since a backup was put back.
TEST_F(JobRunnerTest, NoJobBeginsOnWoodThatMayBeGone) {
  find_hole();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  const Status refused = start();
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("veneerctl panel decide P-0001 1 written-off"));
  EXPECT_EQ(state(), CellState::kIdle);
  decide(db::DifferenceVerdict::kAccepted);
  EXPECT_TRUE(start().ok());
}

// The cell waits for a panel as long as it takes; scans go on.
TEST_F(JobRunnerTest, NoPanelIsCutWhereAScanFoundWoodGoneWhileTheCellWaited) {
  load_first_panel();
  find_hole();
  const Status refused = command(CellCommand::kUnsuspend);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("veneerctl panel decide P-0001 1 written-off"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
  EXPECT_TRUE(database_->call([](Repositories& r) { return r.jobs.runs(JobId{1}); })->empty());
  decide(db::DifferenceVerdict::kAccepted);
  look();
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

// Its strokes are drawn; its wood is written off.
TEST_F(JobRunnerTest, NoPanelIsCutWithAPieceThatIsNotReservedAnyMore) {
  load_first_panel();
  find_hole();
  decide(db::DifferenceVerdict::kWrittenOff);
  const Status refused = command(CellCommand::kUnsuspend);
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_EQ(refused.error().message,
            "piece A1-1 of job 1 is suspect since its cuts were drawn: Stop and Reset the cell, then Start the job "
            "again");
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kReserved, P::kReserved));
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  load_first_panel();
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kSuspect, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, NoJobBeginsOnPanelsThatNobodySawSinceABackupWasPutBack) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(database_
                  ->call([](Repositories& r) {
                    return r.panels.note_restoration("2026-01-01T00:00:00.000Z", "uid 1000",
                                                     "2999-01-01T00:00:00.000Z");
                  })
                  .ok());
  EXPECT_THAT(start().error().message, HasSubstr("scan it, so that what was cut from it meanwhile is known"));
}

TEST_F(JobRunnerTest, AZoneWhereTheHeadMustNotGoIsHeeded) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(16, 0));
  clamp.add(point<MachineFrame>(18, 40));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001");
  look();
  EXPECT_THAT(sentence(), HasSubstr("\"clamp\""));
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, AJogGoesThroughNoZone) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(16, 0));
  clamp.add(point<MachineFrame>(18, 40));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  laser_.can_jog = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  const auto jog = [&](double dx, double dy) {
    return runner_->jog(Millimetres(dx), Millimetres(dy), MmPerSecond(50), "uid 1000");
  };
  EXPECT_TRUE(jog(0, 50).ok());
  const Status across = jog(30, 10);
  ASSERT_FALSE(across.ok());
  EXPECT_EQ(across.error().message, "the zone \"clamp\" lies in that way: go around it");
  laser_.position = point<MachineFrame>(17, 20);  // by hand
  EXPECT_TRUE(jog(-10, 0).ok()) << "out of it";
}

TEST_F(JobRunnerTest, AnOpenLidIsARefusalAndNotAnAbort) {
  load_first_panel();
  laser_.lid_open = true;
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("lid is open"));
  EXPECT_EQ(state(), CellState::kSuspended);
  look();
  EXPECT_THAT(sentence(), HasSubstr("close it"));
  laser_.lid_open = false;
  look();
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, WhatAnOperatorMustConfirmIsAskedByNameEachTime) {
  options_.confirm = {"exhaust", "focus at 2.1 mm"};
  make_runner();
  load_first_panel();
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("exhaust, focus at 2.1 mm"));
  EXPECT_THAT(command(CellCommand::kUnsuspend, {"exhaust"}).error().message,
              HasSubstr("what the beam needs (focus at 2.1 mm): see to it"));
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
  ASSERT_TRUE(command(CellCommand::kUnsuspend, {"focus at 2.1 mm", "exhaust"}).ok());
  // The second panel: hands were in the machine again.
  bed_.lay("P-0002");
  look();
  EXPECT_FALSE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, UnlikelySettingsOfTheControllerAreConfirmedAsWell) {
  options_.confirm = {"exhaust"};
  laser_.to_confirm = {"$30 = 5 (full power)"};
  make_runner();
  load_first_panel();
  EXPECT_THAT(command(CellCommand::kUnsuspend, {"exhaust"}).error().message, HasSubstr("what the beam needs ($30 = 5"));
  EXPECT_TRUE(command(CellCommand::kUnsuspend, {"$30 = 5 (full power)", "exhaust"}).ok());
}

TEST_F(JobRunnerTest, AFileThatRecordsCutsNoWoodOfTheStock) {
  laser_.cuts = false;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_THAT(start().error().message, HasSubstr("a file that records"));
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, APatternIsCheckedAndConfirmedAsWell) {
  options_.confirm = {"exhaust"};
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  Stroke stroke;
  stroke.path = {point<MachineFrame>(10, 10), point<MachineFrame>(900, 10)};
  stroke.speed = MmPerSecond(10);
  stroke.power = PowerFraction(0.2);
  std::optional<Status> out;
  runner_->burn_pattern(LaserJob{{stroke}}, "test", [&](Status s) { out = std::move(s); });
  EXPECT_THAT(out->error().message, HasSubstr("exhaust"));
  runner_->burn_pattern(LaserJob{{stroke}}, "test", [&](Status s) { out = std::move(s); }, {"exhaust"});
  EXPECT_THAT(out->error().message, HasSubstr("leave the machine's travel"));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_THAT(laser_.calls, Not(Contains("start")));
}

TEST_F(JobRunnerTest, TheEstimateIsThereBeforeUnsuspend) {
  load_first_panel();
  EXPECT_DOUBLE_EQ(runner_->view().load->seconds, 2);
  EXPECT_THAT(sentence(), HasSubstr("2 pieces: press"));
}

TEST_F(JobRunnerTest, TheEstimateIsOfTheMachineThatIsThere) {
  laser_.motion =
      LaserMotion{MmPerSecond(150), MmPerSecond(100), MmPerSecond2(300), MmPerSecond2(500), Millimetres(0.002), 100};
  load_first_panel();
  EXPECT_EQ(bed_.told, laser_.motion);
}

TEST_F(JobRunnerTest, TheFrameIsTracedDarkAndCutsNothing) {
  EXPECT_THAT(frame().error().message, HasSubstr("start a job"));
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(frame().error().message, sentence());  // a job was started already: what it waits for is said
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(frame().ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].power.count(), 0);
  EXPECT_EQ(laser_.jobs[0].strokes[0].path.front(), laser_.jobs[0].strokes[0].path.back());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(runner_->view().framing);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kReserved, P::kReserved));
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

TEST_F(JobRunnerTest, TheFrameTakesALowPowerAndNoMore) {
  load_first_panel();
  EXPECT_THAT(frame(0.5).error().message, HasSubstr("at most 3.0 % power"));
  EXPECT_FALSE(frame(-0.1).ok());
  EXPECT_FALSE(frame(std::nan("")).ok());
  ASSERT_TRUE(frame(0.02).ok());
  EXPECT_DOUBLE_EQ(laser_.jobs.at(0).strokes[0].power.count(), 0.02);
}

TEST_F(JobRunnerTest, WhileTheFrameIsTracedNothingElseBeginsAndStopStops) {
  load_first_panel();
  laser_.burn_at_once = false;
  std::optional<Status> traced;
  runner_->frame(PowerFraction(0), "test", [&](Status s) { traced = std::move(s); });
  settle();
  EXPECT_TRUE(runner_->view().framing);
  EXPECT_THAT(command(CellCommand::kUnsuspend).error().message, HasSubstr("tracing the frame"));
  EXPECT_FALSE(frame().ok());
  EXPECT_FALSE(traced);
  laser_.calls.clear();
  runner_->abort("STOP");
  EXPECT_THAT(laser_.calls, ElementsAre("abort"));
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  ASSERT_TRUE(traced);
  EXPECT_FALSE(traced->ok());
  EXPECT_FALSE(runner_->view().framing);
}

TEST_F(JobRunnerTest, HoldEndsAFrameBeamFirst) {
  load_first_panel();
  laser_.burn_at_once = false;
  runner_->frame(PowerFraction(0.02), "test", [](const Status&) {});
  settle();
  ASSERT_TRUE(runner_->view().framing);
  EXPECT_TRUE(runner_->may_move());
  laser_.calls.clear();
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(laser_.calls.front(), "abort");
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("held while tracing the frame"));
  EXPECT_FALSE(runner_->may_move());
}

TEST_F(JobRunnerTest, HoldWhileTheBedIsLookedAtForAFrameGivesItUp) {
  load_first_panel();
  std::optional<Status> traced;
  runner_->frame(PowerFraction(0.02), "test", [&](Status s) { traced = std::move(s); });
  ASSERT_TRUE(runner_->view().framing);
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  settle();
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(runner_->view().framing);
  EXPECT_THAT(laser_.jobs, ::testing::IsEmpty());
  ASSERT_TRUE(traced);
  EXPECT_FALSE(traced->ok());
}

// From the operator's word on, the way out of the picture included; but a run that is held waits for people.
TEST_F(JobRunnerTest, TheMachineMayMoveFromTheWordOnUntilItIsHeld) {
  laser_.burn_at_once = false;
  EXPECT_FALSE(runner_->may_move());
  load_first_panel();
  EXPECT_FALSE(runner_->may_move());
  runner_->command(CellCommand::kUnsuspend, "test", [](const Status&) {});
  ASSERT_EQ(state(), CellState::kUnsuspending);
  EXPECT_TRUE(runner_->may_move());
  settle();
  EXPECT_TRUE(runner_->may_move());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_FALSE(runner_->may_move());
}

TEST_F(JobRunnerTest, ALidOpenedOverTheFrameEndsIt) {
  load_first_panel();
  laser_.burn_at_once = false;
  runner_->frame(PowerFraction(0), "test", [](const Status&) {});
  settle();
  laser_.say(laser_event::Held{});
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(laser_.calls, Contains("abort"));
}

// ---- Recut -------------------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, OnlyTheCutOfAPieceIsRepeatedAndItIsBookedOnce) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kSuspended);  // the second panel is waited for, the first still lies there
  EXPECT_EQ(runner_->view().can_recut, 2);
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-2"}).ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].role, StrokeRole::kCut);
  EXPECT_EQ(laser_.jobs[0].strokes[0].piece.value, 2);
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
  EXPECT_EQ(runner_->view().job->cut, 2);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, ACompleteJobCanBeCutAgainAlsoAfterReset) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("not cut from panel P-0002"));  // another panel's
  ASSERT_TRUE(recut({"A1-3"}).ok());
  EXPECT_EQ(state(), CellState::kComplete);
  EXPECT_EQ(job_state(), db::JobState::kComplete);
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().recut_job, JobId{1});
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-3"}).ok());
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(laser_.jobs.size(), 1U);
  bed_.lay("P-0002", true, 300.2);
  EXPECT_THAT(recut({"A1-3"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_EQ(laser_.jobs.size(), 1U);
}

// No job is current after Reset, but the wood that is burnt is still booked as narrow as the kerf was measured.
TEST_F(JobRunnerTest, WhatIsCutAgainAfterResetKeepsToTheBookedKerf) {
  laser_.can_override = true;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bed_.lay("P-0002");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.burn_at_once = false;
  static_cast<void>(recut({"A1-3"}));
  ASSERT_EQ(state(), CellState::kExecute);
  ASSERT_TRUE(laser_.burning());
  const Status slow = runner_->set_overrides({25, 100, 100});
  ASSERT_FALSE(slow.ok());
  EXPECT_THAT(slow.error().message, HasSubstr("kerf"));
  EXPECT_EQ(laser_.overrides, LaserOverrides{});
  EXPECT_TRUE(runner_->set_overrides({50, 100, 50}).ok());
}

// What was cut is in the database, with the strokes that cut it.
TEST_F(JobRunnerTest, CutsCanBeMetAgainAfterARestart) {
  laser_.identity = "the laser";
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  const LaserJob before = laser_.jobs.at(1);
  restart();
  EXPECT_EQ(runner_->view().can_recut, 2);
  EXPECT_EQ(runner_->view().recut_panel.value, "P-0001");
  EXPECT_EQ(runner_->view().recut_job, JobId{1});
  laser_.jobs.clear();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_FALSE(recut({"A1-2"}).ok()) << "nothing moves before Reset";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(recut({"A1-2"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  EXPECT_TRUE(laser_.jobs.empty());
  bed_.lay("P-0001");
  ASSERT_TRUE(recut({"A1-2"}).ok());
  ASSERT_EQ(laser_.jobs.size(), 1U);
  ASSERT_EQ(laser_.jobs[0].strokes.size(), 1U);
  const Stroke& again = laser_.jobs[0].strokes[0];
  const Stroke& cut = before.strokes.back();
  EXPECT_EQ(again.role, StrokeRole::kCut);
  EXPECT_EQ(again.piece.value, 2);
  EXPECT_EQ(again.path, cut.path);
  EXPECT_EQ(again.speed, cut.speed);
  EXPECT_EQ(again.power, cut.power);
  EXPECT_EQ(again.passes, cut.passes);
  EXPECT_EQ(again.air, cut.air);
}

TEST_F(JobRunnerTest, CutsOfAnotherLaserAreForgottenAlsoAfterARestart) {
  laser_.identity = "the laser";
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.identity = "another";
  restart();
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().can_recut, 0);
  EXPECT_FALSE(recut({"A1-2"}).ok());
  restart();
  EXPECT_EQ(runner_->view().can_recut, 0) << "not even on the first one";
}

TEST_F(JobRunnerTest, NothingIsCutAgainOnceTheAxesWereMeasuredAnew) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  const Status measured = database_->call([](Repositories& r) -> Status {
    const auto issued = r.certificates.list();
    db::CertificateRecord axes;
    for (const auto& known : *issued)
      if (known.kind == db::CertificateKind::kAxes) axes = known;
    axes.id = {};
    auto anew = r.certificates.issue(axes);
    return anew ? Ok() : Status(anew.error());
  });
  ASSERT_TRUE(measured.ok());
  laser_.jobs.clear();
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("the axes certificate is another"));
  EXPECT_TRUE(laser_.jobs.empty());
}

TEST_F(JobRunnerTest, NothingIsCutAgainOnAnotherLaser) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "unplugged"}, false});
  settle();
  ASSERT_EQ(state(), CellState::kAborted);
  EXPECT_EQ(runner_->view().can_recut, 2);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  laser_.identity = "another";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(runner_->view().can_recut, 0);
  EXPECT_FALSE(recut({"A1-1"}).ok());
}

// Its wood may be kept for another piece by now.
TEST_F(JobRunnerTest, APieceThatIsNoLongerBookedAsCutIsNotCutAgain) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(database_->call([](Repositories& r) { return r.jobs.make_suspect({{PieceId{2}}}, kThen); }).ok());
  laser_.jobs.clear();
  EXPECT_THAT(recut({"A1-2"}).error().message, HasSubstr("piece A1-2 is suspect"));
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_TRUE(recut({"A1-1"}).ok());
}

TEST_F(JobRunnerTest, APanelThatMovedIsNotCutAgain) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.jobs.clear();
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(recut({"A1-1"}).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  bed_.lay("P-0002");
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_EQ(state(), CellState::kSuspended);
}

TEST_F(JobRunnerTest, ARecutNeedsTheSameConfirmationsAndAClosedLid) {
  options_.confirm = {"exhaust"};
  make_runner();
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_FALSE(recut({}, {"exhaust"}).ok());
  EXPECT_FALSE(recut({"A9-9"}, {"exhaust"}).ok());
  laser_.lid_open = true;
  EXPECT_THAT(recut({"A1-1"}, {"exhaust"}).error().message, HasSubstr("lid is open"));
  laser_.lid_open = false;
  EXPECT_TRUE(recut({"A1-1"}, {"exhaust"}).ok());
}

TEST_F(JobRunnerTest, AFrameNeedsTheSameConfirmationsOnceItsBeamIsOn) {
  options_.confirm = {"exhaust"};
  make_runner();
  load_first_panel();
  EXPECT_THAT(frame(0.02).error().message, HasSubstr("exhaust"));
  EXPECT_TRUE(laser_.jobs.empty());
  EXPECT_TRUE(frame(0.02, {"exhaust"}).ok());
  EXPECT_TRUE(frame(0).ok());
}

TEST_F(JobRunnerTest, ARecutThatIsBrokenOffNamesThePiece) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-2"}).ok());
  EXPECT_EQ(state(), CellState::kExecute);
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(runner_->view().reason, HasSubstr("piece A1-2 was being cut again: look at it"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().can_recut, 2);
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.burn_at_once = true;
  EXPECT_TRUE(recut({"A1-2"}).ok());
  EXPECT_EQ(state(), CellState::kIdle);
}

TEST_F(JobRunnerTest, ALidOpenedBetweenTwoRecutsHoldsThem) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  laser_.open_and_close_lid();
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(runner_->view().reason, HasSubstr("lid was opened"));
  bed_.lay("P-0001", true, 300.2);
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("moved by 0.20 mm since it was cut"));
  bed_.lay("P-0001");
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
}

TEST_F(JobRunnerTest, ARecutCanBeHeld) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_FALSE(command(CellCommand::kUnhold).ok());
}

// Two people at two screens: what the second asks for meanwhile is refused, and the first one's recut goes on unharmed.
TEST_F(JobRunnerTest, ASecondClientCannotInterfereWithARecutExceptToStopIt) {
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  laser_.burn_at_once = false;
  laser_.jobs.clear();
  ASSERT_TRUE(recut({"A1-1", "A1-2"}).ok());
  EXPECT_FALSE(recut({"A1-1"}).ok());
  EXPECT_FALSE(start().ok());
  EXPECT_FALSE(frame().ok());
  for (const auto other : {CellCommand::kUnsuspend, CellCommand::kReset, CellCommand::kUnhold, CellCommand::kClear})
    EXPECT_FALSE(command(other).ok());
  EXPECT_TRUE(laser_.jobs.empty()) << "nothing was burnt in between";
  EXPECT_EQ(state(), CellState::kExecute);
  laser_.finish();
  settle();
  ASSERT_EQ(laser_.jobs.size(), 1U);
  EXPECT_EQ(laser_.jobs[0].strokes[0].piece.value, 1);
  EXPECT_EQ(state(), CellState::kExecute) << "the first one's second piece";
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(JobRunnerTest, StopAfterThisPieceLetsThePanelLeaveAndTheRestBeCutInANewPose) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  runner_->stop_after_piece("test", [](const Status&) {});
  laser_.finish();
  settle();
  ASSERT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(runner_->view().can_recut, 1);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.lay("P-0001", true, 250);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

// ---- Several set-ups ---------------------------------------------------------------------------------------------

TEST_F(JobRunnerTest, APanelInTwoSetUpsIsAskedForTwiceAndEachTimeOnlyItsPiecesAreCut) {
  bed_.setups = {{PanelId{"P-0001"}, {PieceId{2}}, "200 mm of it sticking out on the left", 1, 2, {}},
                 {PanelId{"P-0001"}, {PieceId{1}}, "200 mm of it sticking out on the right", 2, 2, {}},
                 {PanelId{"P-0002"}, {PieceId{3}}, "", 1, 1, {}}};
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  EXPECT_THAT(sentence(), HasSubstr("200 mm of it sticking out on the left; set-up 1 of 2"));
  bed_.lay("P-0001");
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_THAT(piece_states(), ElementsAre(P::kReserved, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().load->setup.number, 2);
  bed_.lay("P-0001", true, 120);
  look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
  EXPECT_EQ(runner_->view().load->panel.value, "P-0002");
}

}  // namespace
}  // namespace veneer::daemon
