// Hold is never lost and STOP touches nothing that is gone, in whatever turn of the reactor they come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using OnHold = tests::SimLaser::OnHold;

class HoldTest : public JobRunnerTest {
 protected:
  // The first piece of two is being burnt.
  void SetUp() override {
    JobRunnerTest::SetUp();
    laser_.burn_at_once = false;
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_TRUE(laser_.burning());
    ASSERT_EQ(starts(), 1);
  }
  // The reply stays empty until it comes.
  std::shared_ptr<std::optional<Status>> ask(CellCommand command) {
    auto answer = std::make_shared<std::optional<Status>>();
    runner_->command(command, "test", [answer](Status s) { *answer = std::move(s); }, {});
    return answer;
  }
  static bool granted(const std::shared_ptr<std::optional<Status>>& answer) { return *answer && (*answer)->ok(); }
  void burn_the_rest() {
    laser_.burn_at_once = true;
    laser_.finish();
    settle();
  }
};

TEST_F(HoldTest, PressedInTheSameTurnAsDoneHoldsBeforeTheNextPiece) {
  laser_.on_hold = OnHold::kNothing;  // its strokes have ended: there is nothing to hold
  laser_.finish();                    // told, and not yet heard
  const auto held = ask(CellCommand::kHold);
  settle();
  EXPECT_TRUE(granted(held));
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_TRUE(runner_->view().hold_commanded);
  EXPECT_EQ(starts(), 1);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_FALSE(runner_->view().hold_commanded);
  EXPECT_EQ(starts(), 2);
  burn_the_rest();
  EXPECT_THAT(laser_.burnt, ElementsAre(PieceId{1}, PieceId{2}));
}

TEST_F(HoldTest, AnsweredByADriverThatHadEndedIsHeldOnce) {
  laser_.finish();
  const auto held = ask(CellCommand::kHold);  // Held comes behind Done
  settle();
  EXPECT_TRUE(granted(held));
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "resume"), 0) << "there is nothing to resume";
  EXPECT_EQ(starts(), 2);
}

TEST_F(HoldTest, PressedWhileThePieceIsBookedHoldsAtOnce) {
  {
    const SlowDatabase slow(*database_);
    laser_.finish();
    poll();
    ASSERT_FALSE(laser_.burning());
    const auto held = ask(CellCommand::kHold);
    EXPECT_TRUE(granted(held));
    EXPECT_EQ(state(), CellState::kHeld);
  }
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), 1);
}

TEST_F(HoldTest, HoldAndUnholdWhileTheNextPieceIsNotedBeginItOnce) {
  std::optional<SlowDatabase> booking;
  booking.emplace(*database_);
  laser_.finish();
  poll();
  std::optional<SlowDatabase> held_up;
  held_up.emplace(*database_);
  booking.reset();
  while (runner_->view().job->cut < 1) turn();  // booked; the note of the next one waits
  const auto held = ask(CellCommand::kHold);
  EXPECT_TRUE(granted(held));
  const auto unheld = ask(CellCommand::kUnhold);
  poll();
  EXPECT_TRUE(granted(unheld));
  EXPECT_EQ(starts(), 1) << "the note is not written yet";
  held_up.reset();
  settle();
  EXPECT_EQ(state(), CellState::kExecute);
  EXPECT_EQ(starts(), 2);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCutting, P::kReserved));
  burn_the_rest();
  EXPECT_THAT(laser_.burnt, ElementsAre(PieceId{1}, PieceId{2}));
}

TEST_F(HoldTest, HoldAndUnholdWhileThePieceIsBookedBeginTheNextOnce) {
  {
    const SlowDatabase slow(*database_);
    laser_.finish();
    poll();
    ask(CellCommand::kHold);
    ask(CellCommand::kUnhold);
    poll();
    EXPECT_EQ(starts(), 1);
  }
  settle();
  EXPECT_EQ(starts(), 2);
  EXPECT_EQ(state(), CellState::kExecute);
}

// The lid is one reason of several.
TEST_F(HoldTest, WhatStaysHeldSaysWhatHoldsIt) {
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  const auto unhold = [this](std::function<void()> meanwhile) {
    laser_.on_resume = std::move(meanwhile);
    const Status unheld = command(CellCommand::kUnhold);
    EXPECT_EQ(state(), CellState::kHeld);
    return unheld ? std::string() : unheld.error().message;
  };
  EXPECT_EQ(unhold([this] { laser_.open_lid(); }), "the machine stays held: close the lid, then Unhold");
  laser_.close_lid();
  EXPECT_EQ(unhold([this] { laser_.refusal = "the guardian does not answer: restart it"; }),
            "the machine stays held: the guardian does not answer: restart it");
  laser_.refusal.clear();
  EXPECT_EQ(unhold([this] {
              laser_.open_lid();
              laser_.refusal = "the guardian does not answer: restart it";
            }),
            "the machine stays held: close the lid, then Unhold; and the guardian does not answer: restart it");
  laser_.close_lid();
  laser_.refusal.clear();
  EXPECT_THAT(unhold([this] { laser_.stays_held = true; }),
              AllOf(HasSubstr("the machine stays held and does not say why"), Not(HasSubstr("lid"))));
}

TEST_F(HoldTest, ASecondOneIsHarmless) {
  laser_.on_hold = OnHold::kNothing;
  const auto first = ask(CellCommand::kHold), second = ask(CellCommand::kHold);
  poll();
  EXPECT_FALSE(*first);
  EXPECT_FALSE(*second);
  laser_.say(laser_event::Held{});
  settle();
  EXPECT_TRUE(granted(first));
  EXPECT_TRUE(granted(second));
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "hold"), 1);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kExecute);
}

TEST_F(HoldTest, APieceThatWasHeldBeforeItBeganIsStillTheNext) {
  laser_.on_hold = OnHold::kNotBegun;
  EXPECT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 2);
  burn_the_rest();
  EXPECT_THAT(laser_.burnt, ElementsAre(PieceId{1}, PieceId{2}));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_F(HoldTest, ALaserThatRefusesToBeginHoldsTheUnitAndLosesNothing) {
  laser_.finish();
  settle();
  ASSERT_EQ(starts(), 2);
  laser_.say(laser_event::Failed{{ErrorCode::kRefused, "the laser still says that its lid is open: close it"}});
  settle();
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_THAT(runner_->view().reason, HasSubstr("lid is open"));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCutting, P::kReserved));
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(starts(), 3);
}

TEST_F(HoldTest, PressedDuringUnholdIsHeldAgain) {
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  const auto unheld = ask(CellCommand::kUnhold);  // the camera looks
  const auto held = ask(CellCommand::kHold);
  settle();
  EXPECT_TRUE(granted(held));
  ASSERT_TRUE(*unheld);
  EXPECT_FALSE((*unheld)->ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(std::count(laser_.calls.begin(), laser_.calls.end(), "resume"), 0);
}

TEST_F(HoldTest, PressedAfterTheMachineWasToldToGoOnHoldsIt) {
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  const auto unheld = ask(CellCommand::kUnhold);
  while (laser_.calls.back() != "resume") turn();  // the look; then resume() was called, Resumed is on its way
  const auto held = ask(CellCommand::kHold);
  settle();
  EXPECT_TRUE(granted(held));
  EXPECT_TRUE(*unheld);
  EXPECT_EQ(state(), CellState::kHeld);
}

TEST_F(HoldTest, PressedWhileTheLastPieceOfAStopIsFinishedHolds) {
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_EQ(state(), CellState::kStopping);
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(starts(), 1);
}

TEST_F(HoldTest, AStopOutOfAHoldBeginsNoPiece) {
  {
    const SlowDatabase slow(*database_);
    laser_.finish();
    poll();
    ask(CellCommand::kHold);
    ask(CellCommand::kStop);
  }
  settle();
  EXPECT_EQ(state(), CellState::kStopped);
  EXPECT_EQ(starts(), 1);
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kReserved, P::kReserved));
}

TEST_F(JobRunnerTest, HoldWhileThePoseIsProvenBeginsNothing) {
  laser_.burn_at_once = false;
  load_first_panel();
  std::optional<Status> unsuspended, held;
  tell(CellCommand::kUnsuspend, [&](Status s) { unsuspended = std::move(s); });
  tell(CellCommand::kHold, [&](Status s) { held = std::move(s); });
  settle();
  ASSERT_TRUE(held && unsuspended);
  EXPECT_TRUE(held->ok());
  EXPECT_FALSE(unsuspended->ok());
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), 0);
  look();
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok());
}

// ---- In any turn -------------------------------------------------------------------------------------------------

// The n-th handler of the reactor after the first piece's end; the database answers in between, as it likes.
class InTurn : public HoldTest, public ::testing::WithParamInterface<int> {
 protected:
  void SetUp() override {
    HoldTest::SetUp();
    laser_.burn_at_once = GetParam() % 2 == 0;
    laser_.on_hold = GetParam() % 3 == 0 ? OnHold::kNothing : OnHold::kHeld;
    laser_.finish();
    // The database is waited for before each turn, so that the same number is always the same moment.
    for (int i = 0; i < GetParam() / 6; ++i) {
      database_->call([](Repositories&) { return 0; });
      io_.restart();
      io_.poll_one();
    }
  }
};

TEST_P(InTurn, NothingIsBegunAfterAHoldWasAnnounced) {
  const auto held = ask(CellCommand::kHold);
  if (*held && !(*held)->ok()) return;  // the run was over
  const bool begun = laser_.burning();
  const auto before = starts();
  settle();
  if (begun && !*held) {  // a driver that says nothing to a hold goes on to the end of its strokes
    laser_.finish();
    settle();
  }
  EXPECT_TRUE(granted(held));
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(starts(), before);
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  if (laser_.burning()) laser_.finish();
  settle();
  EXPECT_EQ(state(), CellState::kSuspended) << runner_->view().reason;
  EXPECT_THAT(laser_.burnt, ElementsAre(PieceId{1}, PieceId{2}));
  EXPECT_THAT(piece_states(), ElementsAre(P::kCut, P::kCut, P::kReserved));
}

TEST_P(InTurn, StopTouchesNothingThatIsGone) {
  runner_->abort("STOP");
  settle();
  EXPECT_EQ(state(), CellState::kAborted);
  const auto states = piece_states();
  for (const auto piece : states) EXPECT_NE(piece, P::kCutting);
  EXPECT_NE(states[0], P::kReserved) << "it was burnt";
  laser_.burn_at_once = true;
  ASSERT_TRUE(command(CellCommand::kClear).ok());
  EXPECT_TRUE(command(CellCommand::kReset).ok());
  const auto before = starts();
  settle();
  EXPECT_EQ(starts(), before);
}

INSTANTIATE_TEST_SUITE_P(Turns, InTurn, ::testing::Range(0, 90));

}  // namespace
}  // namespace veneer::daemon
