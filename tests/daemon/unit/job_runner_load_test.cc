// What is checked, confirmed and shown before the beam comes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

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
  burn_wanted(LaserJob{{stroke}}, [&](Status s) { out = std::move(s); });
  EXPECT_THAT(out->error().message, HasSubstr("exhaust"));
  burn_wanted(LaserJob{{stroke}}, [&](Status s) { out = std::move(s); }, {"exhaust"});
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

// From the operator's word on, the way out of the picture included; but a run that is held waits for people.
TEST_F(JobRunnerTest, TheMachineMayMoveFromTheWordOnUntilItIsHeld) {
  laser_.burn_at_once = false;
  EXPECT_FALSE(runner_->may_move());
  load_first_panel();
  EXPECT_FALSE(runner_->may_move());
  tell(CellCommand::kUnsuspend);
  ASSERT_EQ(state(), CellState::kUnsuspending);
  EXPECT_TRUE(runner_->may_move());
  settle();
  EXPECT_TRUE(runner_->may_move());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_FALSE(runner_->may_move());
}

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
