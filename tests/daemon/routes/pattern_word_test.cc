// An operator's word for the laser on its own, from the look at the bed over the homing to the beam, without a cell
// around it.
#include "daemon/routes/pattern_word.h"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>

namespace veneer::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Answers when the test says so.
class PlayedUnit final : public UnitState, public PatternCommands {
 public:
  using Reply = PatternCommands::Reply;
  const CellView& view() const override { return cell; }
  bool is_connected() const override { return connected; }
  const LaserLimits& limits() const override { return laser; }
  Consent consent() const override { return now; }
  Status still_holds(const Consent& given) const override { return check_consent(given, now, LaserStatus{}); }
  Status at_rest() const override { return Ok(); }

  Status require_confirmed(const std::vector<std::string>& confirmed) const override {
    if (!confirmed.empty()) return Ok();
    return Error{ErrorCode::kRefused, "exhaust is not confirmed"};
  }
  Status may_burn_pattern(const LaserJob&, const std::vector<std::string>&) const override { return may_burn; }
  void look_for_stock(std::vector<std::string>, Reply reply) override {
    calls.emplace_back("look");
    answer = std::move(reply);
  }
  void home(const std::string&, Reply reply) override {
    calls.emplace_back("home");
    answer = std::move(reply);
  }
  void burn_pattern(Pattern, const std::string&, Reply, std::vector<std::string>, std::function<Status()>) override {
    calls.emplace_back("burn");
  }
  void check_pattern(LaserJob&&, const std::string&, Reply) override { calls.emplace_back("check"); }

  CellView cell;
  LaserLimits laser;
  bool connected = true;
  Consent now{3, 7};
  Status may_burn = Ok();
  std::vector<std::string> calls;
  Reply answer;
};

class PatternWordTest : public ::testing::Test {
 protected:
  void begin(bool burns = true) {
    home_for_pattern(unit_, unit_, task_, {"uid 1000", {"exhaust"}, burns, unit_.now},
                     [this](const Consent& homed) { homed_ = homed; });
  }
  // As the unit does on its way through Resetting to Idle.
  void homed() {
    unit_.now.states += 2;
    unit_.cell.state = CellState::kIdle;
    unit_.answer(Ok());
  }
  std::string failure() {
    io_.restart(), io_.poll();
    const TaskView* task = tasks_.find(task_.id());
    return task->error ? task->error->message : "";
  }

  boost::asio::io_context io_;
  SteadyClock clock_;
  TaskRegistry tasks_{io_, clock_, make_reactor_timer(io_), {}};
  TaskReporter task_ = tasks_.start("laser test-pattern", "getting ready");
  PlayedUnit unit_;
  std::optional<Consent> homed_;
};

TEST_F(PatternWordTest, TheBedIsLookedAtBeforeTheLaserIsHomed) {
  begin();
  EXPECT_THAT(unit_.calls, ElementsAre("look"));
  unit_.answer(Ok());
  EXPECT_THAT(unit_.calls, ElementsAre("look", "home"));
  EXPECT_FALSE(homed_);
  homed();
  ASSERT_TRUE(homed_);
  EXPECT_EQ(homed_->states, 9) << "what is burnt stands on the cell as it is now";
  EXPECT_EQ(homed_->lid_openings, 3);
}

TEST_F(PatternWordTest, NothingIsHomedWhereStockLies) {
  begin();
  unit_.answer(Error{ErrorCode::kRefused, "panel P-0001 of the stock lies on the bed"});
  EXPECT_THAT(unit_.calls, ElementsAre("look"));
  EXPECT_THAT(failure(), HasSubstr("P-0001"));
}

TEST_F(PatternWordTest, WithTheBeamOffNobodyLooks) {
  begin(false);
  EXPECT_THAT(unit_.calls, ElementsAre("home"));
}

TEST_F(PatternWordTest, ALaserThatIsHomedIsNotHomedAgain) {
  unit_.cell.state = CellState::kIdle;
  begin();
  EXPECT_THAT(unit_.calls, IsEmpty());
  EXPECT_TRUE(homed_);
}

TEST_F(PatternWordTest, ALidThatWasOpenedDuringTheLookHomesNothing) {
  begin();
  ++unit_.now.lid_openings;
  unit_.answer(Ok());
  EXPECT_THAT(unit_.calls, ElementsAre("look"));
  EXPECT_THAT(failure(), HasSubstr("the lid was opened"));
}

TEST_F(PatternWordTest, ALidThatWasOpenedDuringTheHomingEndsIt) {
  begin();
  unit_.answer(Ok());
  ++unit_.now.lid_openings;
  homed();
  EXPECT_FALSE(homed_);
  EXPECT_THAT(failure(), HasSubstr("the lid was opened"));
}

// Its first words of the lid are none of its opening.
TEST_F(PatternWordTest, ALaserThatWasNotConnectedTellsOfItsLidWhenItIsHomed) {
  unit_.connected = false;
  begin();
  unit_.answer(Ok());
  unit_.now.lid_openings = 4;
  homed();
  ASSERT_TRUE(homed_) << failure();
  EXPECT_EQ(homed_->lid_openings, 4);
}

TEST_F(PatternWordTest, ATaskThatWasCancelledHomesNothing) {
  begin();
  ASSERT_TRUE(tasks_.cancel(task_.id()).ok());
  unit_.answer(Error{ErrorCode::kUnavailable, "the look was given up"});
  EXPECT_THAT(unit_.calls, ElementsAre("look"));
  EXPECT_THAT(failure(), HasSubstr("cancelled before anything was burnt")) << "and not why the look failed";
}

TEST_F(PatternWordTest, NorDoesOneThatWasCancelledWithTheBeamOff) {
  ASSERT_TRUE(tasks_.cancel(task_.id()).ok());
  begin(false);
  EXPECT_THAT(unit_.calls, IsEmpty());
  EXPECT_FALSE(homed_);
}

TEST_F(PatternWordTest, WhatWouldBeRefusedAfterHomingIsRefusedBefore) {
  const auto refusal = [this](const PatternWord& word) {
    const Status may = may_begin_pattern(unit_, unit_, {}, word);
    return may ? "" : may.error().message;
  };
  EXPECT_EQ(refusal({"uid 1000", {"exhaust"}, true, unit_.now}), "");
  EXPECT_EQ(refusal({"uid 1000", {}, true, unit_.now}), "exhaust is not confirmed");
  EXPECT_EQ(refusal({"uid 1000", {}, false, unit_.now}), "") << "with the beam off";
  unit_.may_burn = Error{ErrorCode::kRefused, "it leaves the travel"};
  EXPECT_EQ(refusal({"uid 1000", {"exhaust"}, true, unit_.now}), "it leaves the travel");
  unit_.cell.state = CellState::kAborted;
  EXPECT_THAT(refusal({"uid 1000", {"exhaust"}, true, unit_.now}), HasSubstr("Clear it first"));
}

}  // namespace
}  // namespace veneer::daemon
