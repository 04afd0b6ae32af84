// Patterns, which belong to no job: never on wood of the stock, and never on a word that was given before hands were
// in.
#include <gmock/gmock.h>

#include "tests/daemon/unit/proof_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

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
    burn_wanted(
        {pattern(power), name_}, [&](Status s) { out = std::move(s); }, std::move(confirmed));
    settle();
    if (laser_.burning()) laser_.finish(), settle();
    return out ? *out : Status(Error{ErrorCode::kInternal, "no reply"});
  }

  std::string name_ = "pattern";
};

// Whoever leaves out what is confirmed, or whether it is still wanted, does not compile: an absent word is no yes.
template <class Unit, class... Words>
constexpr bool kBurns = requires(Unit& unit, Pattern pattern, PatternCommands::Reply reply, Words... words) {
  unit.burn_pattern(pattern, "test", reply, words...);
};
template <class Unit, class... Words>
constexpr bool kMoves = requires(Unit& unit, CellCommands::Reply reply, Words... words) {
  unit.command(CellCommand::kUnsuspend, "test", reply, words...);
};
template <class Unit, class... Words>
constexpr bool kFrames = requires(Unit& unit, CellCommands::Reply reply, Words... words) {
  unit.frame(PowerFraction(0.02), "test", reply, words...);
};

template <class Patterns, class Cell>
void expect_each_word_counts() {
  using Confirmed = std::vector<std::string>;
  using StillWanted = std::function<Status()>;
  EXPECT_TRUE((kBurns<Patterns, Confirmed, StillWanted>)) << "every word is said";
  EXPECT_FALSE((kBurns<Patterns, Confirmed>));
  EXPECT_FALSE((kBurns<Patterns>));
  EXPECT_TRUE((kMoves<Cell, Confirmed>)) << "every word is said";
  EXPECT_FALSE((kMoves<Cell>));
  EXPECT_TRUE((kFrames<Cell, Confirmed>)) << "every word is said";
  EXPECT_FALSE((kFrames<Cell>));
}

TEST(AWordThatIsNotSaid, IsNoYes) {
  expect_each_word_counts<PatternCommands, CellCommands>();  // what routes see of it
  expect_each_word_counts<JobRunner, JobRunner>();
}

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

// Whoever homes the laser for a pattern asks first.
TEST_F(PatternTest, IsRefusedBeforeTheLaserIsHomedWhereThatCanBeKnown) {
  const auto may = [&](std::vector<std::string> confirmed = {}) {
    return runner_->may_burn_pattern(pattern(0.2), confirmed);
  };
  const auto sight = [&](std::vector<std::string> confirmed = {}) {
    std::optional<Status> out;
    runner_->look_for_stock(std::move(confirmed), [&](Status s) { out = std::move(s); });
    settle();
    return out.value_or(Status(Error{ErrorCode::kInternal, "no reply"}));
  };
  ASSERT_EQ(state(), CellState::kStopped);
  EXPECT_TRUE(may().ok()) << "of a laser that was never there nothing more is known";
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  EXPECT_THAT(sight({"scrap on the bed"}).error().message, HasSubstr("panel P-0001 of the stock"));
  bed_.stock = StockSight{{}, {"tag 300 of no known panel is in sight"}};
  EXPECT_THAT(sight().error().message, HasSubstr("--confirm \"scrap on the bed\""));
  EXPECT_TRUE(sight({"scrap on the bed"}).ok());
  bed_.stock = StockSight{};
  EXPECT_TRUE(sight().ok());

  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(burn(0).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  EXPECT_TRUE(may().ok());
  laser_.open_lid();
  EXPECT_THAT(may().error().message, HasSubstr("the lid is open: close it"));
  laser_.close_lid();
  LaserJob astray = pattern(0.2);
  astray.strokes.front().path.back() = point<MachineFrame>(5000, 10);
  EXPECT_THAT(runner_->may_burn_pattern(astray, {}).error().message, HasSubstr("would leave the machine's travel"));
  options_.confirm = {"exhaust"};
  make_runner();
  EXPECT_THAT(may().error().message, HasSubstr("exhaust"));
  EXPECT_TRUE(may({"exhaust"}).ok());
}

TEST_F(PatternTest, IsReachedFromWhereHomingLeavesTheHeadUnlessTheCellIsIdle) {
  Box<MachineFrame> clamp;
  clamp.add(point<MachineFrame>(5, 20)), clamp.add(point<MachineFrame>(60, 25));
  options_.keep_out = {{"clamp", clamp}};
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.position = point<MachineFrame>(10, 5);
  ASSERT_TRUE(burn(0).ok());
  ASSERT_EQ(state(), CellState::kComplete);
  laser_.position = point<MachineFrame>(30, 40);
  EXPECT_TRUE(runner_->may_burn_pattern(pattern(0.2), {}).ok()) << "it will not begin from behind the clamp";
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  laser_.position = point<MachineFrame>(30, 40);
  EXPECT_THAT(runner_->may_burn_pattern(pattern(0.2), {}).error().message, HasSubstr("clamp"));
}

// With the beam on, and with it off: no look at the bed stands before that.
class CancelledPatternTest : public PatternTest, public ::testing::WithParamInterface<double> {
 protected:
  void begin() {
    runner_->burn_pattern(
        {pattern(GetParam()), name_}, "test", [this](Status s) { over_ = std::move(s); }, {},
        [this] { return wanted_; });
  }
  void cancel() { wanted_ = Error{ErrorCode::kCancelled, "it was cancelled before anything was burnt"}; }

  std::optional<Status> over_;

 private:
  Status wanted_ = Ok();
};
INSTANTIATE_TEST_SUITE_P(Power, CancelledPatternTest, ::testing::Values(0.2, 0.0));

// The task was cancelled while it burnt, and an operator held it then.
TEST_P(CancelledPatternTest, OneThatWasCancelledInItsMidstIsNotSaidToBeUnburnt) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  begin();
  settle();
  ASSERT_TRUE(laser_.burning());
  EXPECT_TRUE(runner_->view().alone);
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_FALSE(runner_->view().only_stop) << "it is still wanted";
  ASSERT_TRUE(command(CellCommand::kUnhold).ok());
  ASSERT_TRUE(laser_.burning());
  cancel();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_TRUE(runner_->view().only_stop) << "before anybody has tried";
  const Status unheld = command(CellCommand::kUnhold);
  ASSERT_FALSE(unheld.ok());
  EXPECT_EQ(unheld.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(unheld.error().message,
            GetParam() > 0 ? "the pattern was cancelled after it was begun, and part of it may be burnt: Stop ends it"
                           : "the pattern was cancelled after it was begun: Stop ends it");
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_EQ(reason(), unheld.error().message);
  EXPECT_TRUE(runner_->view().only_stop);
  ASSERT_TRUE(command(CellCommand::kStop).ok());
  EXPECT_NE(state(), CellState::kHeld) << "as it says";
  EXPECT_FALSE(runner_->view().alone);
  EXPECT_FALSE(runner_->view().only_stop);
}

// The task may be cancelled while it is held already: then Unhold finds out.
TEST_P(CancelledPatternTest, OneThatWasCancelledWhileItWasHeldCanOnlyBeStopped) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  begin();
  settle();
  ASSERT_TRUE(laser_.burning());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  cancel();
  ASSERT_FALSE(command(CellCommand::kUnhold).ok());
  EXPECT_EQ(state(), CellState::kHeld);
  EXPECT_TRUE(runner_->view().only_stop);
}

// Close the lid, and then hear that it is of no use?
TEST_P(CancelledPatternTest, ThatItWasCancelledIsToldBeforeWhatElseStandsInTheWay) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  begin();
  settle();
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  cancel();
  laser_.open_lid();
  EXPECT_THAT(command(CellCommand::kUnhold).error().message, HasSubstr("Stop ends it"));
}

TEST_P(CancelledPatternTest, OneThatWasCancelledBeforeItWasOnRecordDoesNotBegin) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  {
    const SlowDatabase slow(*database_);
    begin();
    poll();
    cancel();
  }
  settle();
  EXPECT_EQ(starts(), 0);
  EXPECT_EQ(state(), CellState::kIdle);
  ASSERT_TRUE(over_ && !over_->ok());
  EXPECT_EQ(over_->error().code, ErrorCode::kCancelled);
  EXPECT_EQ(over_->error().message, "it was cancelled before anything was burnt");
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

TEST_F(PatternTest, IsCalledWhatItIs) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  name_ = "drawing";
  EXPECT_TRUE(burn(0.2).ok());
  EXPECT_EQ(reason(), "the drawing is burnt");
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_TRUE(burn(0).ok());
  EXPECT_EQ(reason(), "the drawing was run with the beam off");
}

TEST_F(PatternTest, RunsDarkOverAnything) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  bed_.stock = StockSight{{PanelId{"P-0001"}}, {}};
  EXPECT_TRUE(burn(0).ok());
  EXPECT_EQ(starts(), 1);
  EXPECT_EQ(bed_.looks, 0);
  EXPECT_THAT(reason(), HasSubstr("beam off"));
}

}  // namespace
}  // namespace veneer::daemon
