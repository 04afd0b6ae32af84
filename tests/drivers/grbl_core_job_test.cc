// The core against a script, while a job runs: what it sends, and what it makes of answers no simulator would give.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/drivers/grbl_core_fixture.h"

namespace veneer::grbl {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(GrblCoreTest, SendsNoByteOfAJobThatLeavesTheTravel) {
  connect_and_home();
  LaserJob job = line_job();
  job.strokes.push_back(job.strokes.front());
  job.strokes.back().path.back() = point<MachineFrame>(500, 380);
  core.start(job, now);
  EXPECT_EQ(out(), "");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_EQ(event<laser_event::Failed>()->error.code, ErrorCode::kInvalidArgument);
}

TEST_F(GrblCoreTest, ReportsNothingExecutedWhileTheMachineStandsAtTheStart) {
  connect_and_home();
  const std::string sent = begin_line();
  EXPECT_THAT(sent, HasSubstr("S850\n$G\n"));
  // All lines are answered at once, the machine has not moved yet.
  for (int i = 0; i < 12; ++i) say("ok\r\n");
  wait_in("<Run|MPos:-1.000,-1.000,0.000|FS:0,0>", 1s);
  EXPECT_FALSE(event<laser_event::StrokeExecuted>());
}

TEST_F(GrblCoreTest, AbortsWhenPowerWasUnderstoodDifferently) {
  connect_and_home();
  begin_line();
  say("ok\r\n");
  EXPECT_EQ(say("[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 F900 S50]\r\n"), "!");
  EXPECT_EQ(wait_in("<Hold:0|MPos:-3.000,-1.000,0.000|FS:0,0>", 200ms).substr(0, 1), "\x18");
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->error.message, HasSubstr("S50"));
  EXPECT_FALSE(event<laser_event::Aborted>()->position_lost) << "it stood still before the reset";
}

TEST_F(GrblCoreTest, SendsNoMotionBeforeModesAndFeedAreKnownToBeUnderstood) {
  connect_and_home();
  core.start(line_job(), now);
  EXPECT_THAT(out(), ::testing::Not(HasSubstr("X")));
  say("ok\r\nok\r\nok\r\n");
  EXPECT_EQ(say("[GC:G0 G54 G17 G21 G91 G94 M4 M9 T0 F90 S0]\r\n"), "!") << "a digit of F900 was lost";
  EXPECT_EQ(say("ok\r\n"), "");
  EXPECT_EQ(wait_in("<Hold:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms).substr(0, 1), "\x18");
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->suspect, ::testing::IsEmpty()) << "nothing was burnt";
}

TEST_F(GrblCoreTest, AbortsWhenTheMachineIsOffItsPath) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-3.000,-1.300,0.000|FS:900,850>", 250ms);
  EXPECT_FALSE(event<laser_event::Aborted>()) << "one report may be garbled";
  wait_in("<Run|MPos:-3.200,-1.300,0.000|FS:900,850>", 2s);
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->error.message, HasSubstr("off its path"));
}

TEST_F(GrblCoreTest, AnAbortOffThePathSaysWhereTheBeamMayHaveBeen) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-2.500,-1.000,0.000|FS:900,850>", 250ms);
  wait_in("<Run|MPos:-3.000,-1.300,0.000|FS:900,850>", 250ms);
  wait_in("<Hold:0|MPos:-3.600,-1.500,0.000|FS:0,0>", 2s);
  const auto aborted = event<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  ASSERT_GE(aborted->stray_path.size(), 3U);
  EXPECT_NEAR(aborted->stray_path.front().x.count(), 517.5, 1e-9) << "the last place that was on the path";
  EXPECT_NEAR(aborted->stray_path.front().y.count(), 379, 1e-9);
  EXPECT_NEAR(aborted->stray_path.back().x.count(), 516.4, 1e-9) << "where it stands";
  EXPECT_NEAR(aborted->stray_path.back().y.count(), 378.5, 1e-9);
  EXPECT_GT(aborted->stray_reach.count(), 0.5) << "at 15 mm/s, some 0.1 s between two reports";
  EXPECT_LT(aborted->stray_reach.count(), 4);
}

// ---- what else says that the head did something else than it was told

class GrblStrayTest : public GrblCoreTest {
 protected:
  // The first burning line is out, and the head was last reported on its way.
  void burn() {
    connect_and_home();
    begin_line();
    wait_in("<Run|MPos:-2.500,-1.000,0.000|FS:900,850>", 250ms);
    EXPECT_FALSE(event<laser_event::Aborted>());
  }
  void expect_stray(const std::optional<laser_event::Aborted>& aborted) {
    ASSERT_TRUE(aborted);
    ASSERT_FALSE(aborted->stray_path.empty()) << aborted->error.message;
    EXPECT_NEAR(aborted->stray_path.front().x.count(), 517.5, 1e-9) << "the last place that was on the path";
    EXPECT_NEAR(aborted->stray_path.front().y.count(), 379, 1e-9);
    EXPECT_GT(aborted->stray_reach.count(), 0.01);
  }
  std::optional<laser_event::Aborted> stop_softly() {
    wait_in("<Hold:0|MPos:-3.600,-1.500,0.000|FS:0,0>", 2s);
    return event<laser_event::Aborted>();
  }
  void expect_stands_aside(const std::optional<laser_event::Aborted>& aborted) {
    expect_stray(aborted);
    ASSERT_TRUE(aborted && !aborted->stray_path.empty());
    EXPECT_NEAR(aborted->stray_path.back().x.count(), 516.4, 1e-9) << "where it stands";
    EXPECT_NEAR(aborted->stray_path.back().y.count(), 378.5, 1e-9);
  }
};

TEST_F(GrblStrayTest, AnotherWayToCountPlacesMayHaveMovedTheBeamAside) {
  for (const char* modes : {"G1 G54 G17 G21 G90 G94 M4", "G2 G54 G17 G21 G91 G94 M4"}) {
    SCOPED_TRACE(modes);
    make_core({});
    events.clear();
    burn();
    say("ok\r\n");
    EXPECT_EQ(say(std::string("[GC:") + modes + " M9 T0 F900 S850]\r\n"), "!");
    expect_stands_aside(stop_softly());
  }
}

// In inches its feed is another one too: it may have gone as fast as the machine can.
TEST_F(GrblStrayTest, InInchesTheBeamMayHaveGoneAsFastAsTheMachineCan) {
  burn();
  say("ok\r\n");
  EXPECT_EQ(say("[GC:G1 G54 G17 G20 G91 G94 M4 M9 T0 F900 S850]\r\n"), "!");
  const auto aborted = stop_softly();
  expect_stands_aside(aborted);
  EXPECT_GT(aborted->stray_reach.count(), 5) << "at 400 mm/s, not at the stroke's 15";
}

TEST_F(GrblStrayTest, AnotherFeedOrPowerAloneAccusesNobody) {
  for (const char* words : {"F90 S850", "F900 S50"}) {
    SCOPED_TRACE(words);
    make_core({});
    events.clear();
    burn();
    say("ok\r\n");
    EXPECT_EQ(say(std::string("[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 ") + words + "]\r\n"), "!");
    const auto aborted = stop_softly();
    ASSERT_TRUE(aborted);
    EXPECT_THAT(aborted->stray_path, ::testing::IsEmpty());
  }
}

TEST_F(GrblStrayTest, ModesThatAreWrongBeforeAnyMotionAccuseNobody) {
  connect_and_home();
  core.start(line_job(), now);
  out();
  say("ok\r\nok\r\nok\r\n");
  EXPECT_EQ(say("[GC:G0 G54 G17 G21 G90 G94 M4 M9 T0 F900 S0]\r\n"), "!");
  wait_in("<Hold:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->stray_path, ::testing::IsEmpty());
}

TEST_F(GrblStrayTest, ALineThatWasNotToldBackMayBeAnotherThatIsLost) {
  burn();
  say("ok\r\n");
  EXPECT_EQ(say("ok\r\n"), "!") << "the answer to $G came without the modes";
  expect_stands_aside(stop_softly());
}

// Two lines that arrived as one lead aside and back between two reports; all that shows is that the machine is late.
TEST_F(GrblStrayTest, ALateMachineMayHaveBeenAsideBetweenItsLastReports) {
  burn();
  say("ok\r\n[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 F900 S850]\r\nok\r\nok\r\nok\r\n");
  wait_in("<Run|MPos:-3.000,-1.000,0.000|FS:900,850>", 4s);
  const auto aborted = event<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  ASSERT_THAT(aborted->error.message, HasSubstr("later than its settings allow"));
  const auto passed = [&](double x) {
    return std::any_of(aborted->stray_path.begin(), aborted->stray_path.end(),
                       [x](const auto& place) { return std::abs(place.x.count() - x) < 1e-9; });
  };
  EXPECT_TRUE(passed(517.5)) << "where it was before";
  EXPECT_TRUE(passed(517)) << "where it stands";
  EXPECT_GT(aborted->stray_reach.count(), 0.5) << "15 mm/s for up to 0.2 s between two reports, there and back";
  EXPECT_LT(aborted->stray_reach.count(), 4);
}

// A line that arrived as two.
TEST_F(GrblStrayTest, AnAnswerTooManyMayBeALineTooMany) {
  burn();
  say("ok\r\n[GC:G1 G54 G17 G21 G91 G94 M4 M9 T0 F900 S850]\r\n");
  for (int i = 0; i < 40 && !event<laser_event::Aborted>(); ++i) say("ok\r\n");
  const auto aborted = event<laser_event::Aborted>();
  expect_stray(aborted);
  EXPECT_THAT(aborted->error.message, HasSubstr("answered more lines than it was sent"));
  EXPECT_TRUE(aborted->position_lost);
}

// In a job that was checked whole the head met a switch, or was sent beyond the travel: it is not where it was counted.
TEST_F(GrblStrayTest, ALimitInACheckedJobSaysThatTheHeadIsElsewhere) {
  for (const char* alarm : {"ALARM:1\r\n", "ALARM:2\r\n"}) {
    SCOPED_TRACE(alarm);
    make_core({});
    events.clear();
    burn();
    say(alarm);
    expect_stray(event<laser_event::Aborted>());
  }
}

TEST_F(GrblStrayTest, AnAlarmOfAnotherKindAccusesNobody) {
  burn();
  say("ALARM:3\r\n");
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->stray_path, ::testing::IsEmpty());
}

// Of a machine that did not do in time what it was told.
auto names_each_cause() {
  return AllOf(HasSubstr("its controller hung or was busy with something else"), HasSubstr("the cable had lost a byte"),
               HasSubstr("this computer was too loaded to hear it"), HasSubstr("end other heavy programs"));
}

// It tells where it stands and answers no line: what a controller looks like that serves somebody else, too.
TEST_F(GrblCoreTest, AStallNamesEachThatMayHaveCausedIt) {
  GrblOptions options;
  options.late_tolerance = 1h;  // which would notice first
  make_core(options);
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-1.000,-1.000,0.000|FS:0,0>", options.stall_timeout - 100ms);
  EXPECT_FALSE(event<laser_event::Aborted>());
  wait_in("<Run|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
  const auto aborted = event<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  EXPECT_THAT(aborted->error.message, names_each_cause());
  EXPECT_THAT(aborted->error.message, HasSubstr("then Clear and Reset"));
}

TEST_F(GrblCoreTest, AJogThatStallsNamesEachToo) {
  connect_and_home();
  ASSERT_TRUE(core.jog(Millimetres(-10), Millimetres(0), MmPerSecond(50), now));
  wait_in("<Jog|MPos:-1.000,-1.000,0.000|FS:0,0>", GrblOptions().stall_timeout + 100ms);
  const auto ended = event<laser_event::JogEnded>();
  ASSERT_TRUE(ended && ended->error);
  EXPECT_THAT(ended->error->message, StartsWith("the laser neither moves nor answers while it is jogged"));
  EXPECT_THAT(ended->error->message, names_each_cause());
}

// Whoever asks for homing is Aborted by its failure, where Clear comes first.
TEST_F(GrblCoreTest, WhileItIsBusyHomingIsRefusedWithAllThatComesBeforeReset) {
  const auto refusal = [&](const char* doing) {
    events.clear();
    core.home(now);
    const auto failed = event<laser_event::Failed>();
    EXPECT_TRUE(failed) << doing;
    return failed ? failed->error.message : std::string();
  };
  constexpr const char* kBusy = "the laser is busy: wait until it stands still, then Clear and Reset";
  connect_and_home();
  ASSERT_TRUE(core.jog(Millimetres(-10), Millimetres(0), MmPerSecond(50), now));
  EXPECT_EQ(refusal("a jog"), kBusy);
  make_core({});
  connect_and_home();
  ASSERT_TRUE(core.check(line_job(), now));
  EXPECT_EQ(refusal("a check"), kBusy);
  make_core({});
  connect_and_home();
  wait_in("<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 1s);
  core.start(line_job(), now);
  EXPECT_EQ(refusal("a start behind the lid"), kBusy);
}

TEST_F(GrblCoreTest, AHoldThatIsNotReachedNamesEachToo) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-2.000,-1.000,0.000|FS:900,850>", 200ms);
  core.hold(now);
  wait_in("<Hold:1|MPos:-2.100,-1.000,0.000|FS:300,280>", GrblOptions().hold_timeout + 100ms);
  const auto aborted = event<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  EXPECT_THAT(aborted->error.message, StartsWith("the laser did not stand still with the beam off after a hold"));
  EXPECT_THAT(aborted->error.message, names_each_cause());
}

TEST_F(GrblCoreTest, HomingThatDoesNotEndNamesEachToo) {
  connect();
  core.home(now);
  wait(GrblOptions().homing_timeout + 100ms);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, StartsWith("the laser did not finish homing in time"));
  EXPECT_THAT(failed->error.message, names_each_cause());
}

TEST_F(GrblCoreTest, AControllerThatDoesNotComeBackFromItsResetNamesEachToo) {
  connect_and_home();
  core.abort(now);
  core.home(now);
  wait(GrblOptions().banner_wait + 100ms);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, StartsWith("the laser controller does not come back from its reset"));
  EXPECT_THAT(failed->error.message, names_each_cause());
}

TEST_F(GrblCoreTest, AFocusThatIsNotReachedNamesEachToo) {
  GrblOptions options;
  options.focus_z = Millimetres(-12.5);
  make_core(options);
  connect();
  core.home(now);
  say("ok\r\n");
  wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
  say("ok\r\n");
  wait_in("<Idle|MPos:-1.000,-1.000,-3.000|FS:0,0>", options.homing_timeout);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, StartsWith("the laser's head did not reach the focus height"));
  EXPECT_THAT(failed->error.message, names_each_cause());
}

// A panel was laid through the lid, and the controller does not come out of its wait.
TEST_F(GrblCoreTest, ALidThatIsClosedAgainIsNotCalledOpen) {
  connect_and_home();
  wait_in("<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 1s);
  core.start(line_job(), now);
  EXPECT_EQ(out(), "~");
  wait_in("<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>", GrblOptions().resume_timeout + 100ms);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, StartsWith("the laser still says \"Door:0\", though its lid is closed"));
  EXPECT_THAT(failed->error.message, names_each_cause());
}

TEST_F(GrblCoreTest, ACheckThatStallsNamesEachToo) {
  connect_and_home();
  ASSERT_TRUE(core.check(line_job(), now));
  wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", GrblOptions().stall_timeout + 100ms);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_THAT(failed->error.message, StartsWith("the laser controller stopped answering in its check mode"));
  EXPECT_THAT(failed->error.message, names_each_cause());
}

TEST_F(GrblCoreTest, AnAbortOnThePathAccusesNobody) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-2.500,-1.000,0.000|FS:900,850>", 250ms);
  core.abort(now);
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->stray_path, ::testing::IsEmpty());
}

TEST_F(GrblCoreTest, AbortsWhenSomebodyTurnsTheOverrides) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-3.000,-1.000,0.000|FS:900,850|Ov:100,100,110>", 400ms);
  wait_in("<Hold:0|MPos:-3.000,-1.000,0.000|FS:0,0>", 1s);
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->error.message, HasSubstr("override"));
}

TEST_F(GrblCoreTest, HoldsOnlyWhenTheBeamIsSeenOff) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-2.000,-1.000,0.000|FS:900,850>", 200ms);
  core.hold(now);
  EXPECT_EQ(out(), "!");
  wait_in("<Hold:1|MPos:-2.100,-1.000,0.000|FS:300,280>", 200ms);
  EXPECT_FALSE(event<laser_event::Held>());
  wait_in("<Hold:0|MPos:-2.200,-1.000,0.000|FS:0,280>", 200ms);
  EXPECT_FALSE(event<laser_event::Held>()) << "a beam that stays on is no hold";
  wait_in("<Hold:0|MPos:-2.200,-1.000,0.000|FS:0,0>", 200ms);
  EXPECT_TRUE(event<laser_event::Held>());
  EXPECT_EQ(wait_in("<Hold:0|MPos:-2.200,-1.000,0.000|FS:0,0>", 300s), "") << "held for ever, and silent";
}

TEST_F(GrblCoreTest, ResetsAMachineThatKeepsItsBeamOnInHold) {
  connect_and_home();
  begin_line();
  core.hold(now);
  out();
  EXPECT_THAT(wait_in("<Hold:0|MPos:-2.200,-1.000,0.000|FS:0,280>", 3s), HasSubstr("\x18"));
  EXPECT_TRUE(event<laser_event::Aborted>());
}

TEST_F(GrblCoreTest, AbortsWhenTheMachineMovesOnByItself) {
  connect_and_home();
  begin_line();
  core.hold(now);
  out();
  wait_in("<Hold:0|MPos:-2.200,-1.000,0.000|FS:0,0>", 200ms);
  EXPECT_THAT(wait_in("<Run|MPos:-2.400,-1.000,0.000|FS:900,850>", 300ms), HasSubstr("\x18"));
  EXPECT_TRUE(event<laser_event::Aborted>());
}

TEST_F(GrblCoreTest, SilenceEndsTheJobAndTheLink) {
  connect_and_home();
  begin_line();
  EXPECT_THAT(wait(3s), HasSubstr("\x18")) << "in case somebody still listens";
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_EQ(event<laser_event::Aborted>()->error.code, ErrorCode::kDisconnected);
  EXPECT_EQ(event<laser_event::Aborted>()->suspect, std::vector{PieceId{7}});
  EXPECT_TRUE(event<laser_event::Aborted>()->position_lost);
  EXPECT_TRUE(closed);
  EXPECT_FALSE(core.status().connected);
}

TEST_F(GrblCoreTest, WritesNoSettingEver) {
  connect_and_home();
  const std::string sent = begin_line();
  EXPECT_EQ(sent.find('='), std::string::npos);
  EXPECT_EQ(sent.find("$X"), std::string::npos) << "an alarm is never unlocked";
}

}  // namespace
}  // namespace veneer::grbl
