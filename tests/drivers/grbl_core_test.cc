// The core against a script: what it says first, what it makes of answers no simulator would give.
#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr const char* kBanner = "\r\nGrbl 1.1h ['$' for help]\r\n";
constexpr const char* kSettings =
    "$13=0\r\n$22=1\r\n$23=0\r\n$27=1.000\r\n$30=1000\r\n$32=1\r\n$100=80\r\n$101=80\r\n$110=24000\r\n$111=24000\r\n"
    "$120=1500\r\n$121=1500\r\n$130=520\r\n$131=380\r\nok\r\n";
constexpr const char* kModes = "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n";

class GrblCoreTest : public ::testing::Test {
 protected:
  std::string out() {
    const GrblOutput output = core.take_output();
    closed = closed || output.close;
    std::string all = output.urgent;
    for (const char c : output.bytes)
      if (c != '?') all += c;
    return all;
  }
  std::string say(std::string_view bytes) {
    core.receive(bytes, now);
    return out();
  }
  // Answers nothing.
  std::string wait(Duration time) {
    std::string said;
    const TimePoint end = now + time;
    while (core.next_deadline() <= end) {
      now = std::max(now, core.next_deadline());
      core.tick(now);
      said += out();
    }
    now = end;
    core.tick(now);
    return said + out();
  }
  // Answers each poll with this report.
  std::string wait_in(const std::string& report, Duration time) {
    std::string said;
    for (const TimePoint end = now + time; now < end;) {
      now = std::min(end, std::max(core.next_deadline(), now + 1ms));
      core.tick(now);
      const GrblOutput output = core.take_output();
      said += output.urgent;
      for (const char c : output.bytes) {
        if (c == '?') core.receive(report + "\r\n", now);
        if (c != '?') said += c;
      }
      said += out();
    }
    return said;
  }
  void connect() {
    core.connect(now);
    out();
    say(kBanner);
    wait(250ms);
    say("[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n");
    say(kSettings);
    say(kSettings);
    say(kModes);
    wait_in("<Alarm|MPos:0.000,0.000,0.000|FS:0,0>", 100ms);
  }
  void connect_and_home() {
    connect();
    core.home(now);
    ASSERT_EQ(out(), "$H\n");
    say("ok\r\n");
    wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
    core.take_events();
  }
  // A core stays where it is made: its phases know it.
  void make_core(const GrblOptions& options) {
    std::destroy_at(&core);
    std::construct_at(&core, options);
  }
  template <class Event>
  std::optional<Event> event() {
    for (LaserEvent& e : core.take_events()) events.push_back(std::move(e));
    for (const LaserEvent& e : events)
      if (const auto* wanted = std::get_if<Event>(&e)) return *wanted;
    return std::nullopt;
  }
  static LaserJob line_job() {
    Stroke stroke{PieceId{7},      StrokeRole::kCut,    {point<MachineFrame>(519, 379), point<MachineFrame>(500, 379)},
                  MmPerSecond(15), PowerFraction(0.85), 1};
    return {{stroke}};
  }

  // A job whose modes and feed were understood; its motions are on their way.
  std::string begin_line() {
    core.start(line_job(), now);
    EXPECT_EQ(out(), "G0G17G21G91G94\nG0M4S0\nF900\n$G\n");
    return say("ok\r\nok\r\nok\r\n[GC:G0 G54 G17 G21 G91 G94 M4 M9 T0 F900 S0]\r\nok\r\n");
  }

  GrblCore core;
  TimePoint now{};
  std::vector<LaserEvent> events;
  bool closed = false;
};

TEST_F(GrblCoreTest, ConnectsWithAResetAndReadsAllItNeeds) {
  core.connect(now);
  EXPECT_EQ(out(), "\x18");
  EXPECT_EQ(say(kBanner), "") << "another banner may follow";
  EXPECT_EQ(wait(250ms), "$I\n");
  EXPECT_EQ(say("[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n"), "$$\n");
  EXPECT_EQ(say(kSettings), "$$\n") << "asked twice: a digit may be lost on the way";
  EXPECT_EQ(say(kSettings), "$G\n");
  EXPECT_EQ(say(kModes), "");
  EXPECT_EQ(wait_in("<Alarm|MPos:0.000,0.000,0.000|FS:0,0>", 100ms), "");
  const auto connected = event<laser_event::Connected>();
  ASSERT_TRUE(connected);
  EXPECT_EQ(connected->limits.firmware, "Grbl 1.1h");
  EXPECT_DOUBLE_EQ(connected->limits.travel.max.x.count(), 519);
  ASSERT_TRUE(connected->limits.motion);
  EXPECT_EQ(*connected->limits.motion, (LaserMotion{MmPerSecond(400), MmPerSecond(400), MmPerSecond2(1500),
                                                    MmPerSecond2(1500), Millimetres(0.01), 15}));
  EXPECT_TRUE(core.status().connected);
  EXPECT_FALSE(core.status().homed);
}

TEST_F(GrblCoreTest, ConnectsToAControllerThatPrintsNoBanner) {
  core.connect(now);
  out();
  std::string said = wait_in("<Idle|MPos:0.000,0.000,0.000|FS:0,0>", 1700ms);
  EXPECT_EQ(said, "$I\n");
  EXPECT_EQ(say("error:3\r\n"), "$$\n") << "without $I stock sizes are assumed";
  say(kSettings);
  say(kSettings);
  say(kModes);
  wait_in("<Idle|MPos:0.000,0.000,0.000|FS:0,0>", 100ms);
  EXPECT_TRUE(event<laser_event::Connected>());
}

TEST_F(GrblCoreTest, GivesUpWithinFiveSecondsWhenNobodyAnswers) {
  core.connect(now);
  out();
  wait(5s);
  const auto failed = event<laser_event::Failed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->error.code, ErrorCode::kTimeout);
  EXPECT_TRUE(closed);
  EXPECT_EQ(core.next_deadline(), TimePoint::max());
}

TEST_F(GrblCoreTest, RefusesAControllerThatIsNotInLaserMode) {
  core.connect(now);
  out();
  say(kBanner);
  wait(250ms);
  say("ok\r\n");
  std::string settings = kSettings;
  settings.replace(settings.find("$32=1"), 5, "$32=0");
  say(settings);
  say(settings);
  say(kModes);
  wait_in("<Idle|MPos:0.000,0.000,0.000|FS:0,0>", 100ms);
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("$32=1"));
}

TEST_F(GrblCoreTest, MovesNothingBeforeHomingAndRefusesJobsUntilThen) {
  connect();
  core.start(line_job(), now);
  EXPECT_EQ(out(), "");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_EQ(event<laser_event::Failed>()->error.code, ErrorCode::kRefused);
  EXPECT_EQ(wait_in("<Idle|MPos:0.000,0.000,0.000|FS:0,0>", 60s), "");
}

TEST_F(GrblCoreTest, AHomingThatWaitsForAResetDoesNotBeginBehindAStop) {
  connect_and_home();
  core.abort(now);
  out();
  core.home(now);
  core.abort(now);
  EXPECT_EQ(out(), "\x18");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_EQ(event<laser_event::Failed>()->error.code, ErrorCode::kCancelled);
  say(kBanner);
  EXPECT_EQ(wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 5s), "");
}

TEST_F(GrblCoreTest, RefusesACornerThatIsNotWhereTheSettingsPutIt) {
  connect();
  core.home(now);
  out();
  say("ok\r\n");
  wait_in("<Idle|MPos:0.000,0.000,0.000|FS:0,0>", 200ms);
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("$23"));
  EXPECT_FALSE(core.status().homed);
}

TEST_F(GrblCoreTest, AsksNothingWhileTheMachineHomes) {
  connect();
  core.home(now);
  EXPECT_EQ(out(), "$H\n");
  for (int i = 0; i < 50; ++i) {
    now += 1s;
    core.tick(now);
    EXPECT_TRUE(core.take_output().bytes.empty());
  }
  EXPECT_FALSE(event<laser_event::Failed>());
  say("ok\r\n");
  wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
  EXPECT_TRUE(event<laser_event::Homed>());
}

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

TEST_F(GrblCoreTest, AnAbortOnThePathAccusesNobody) {
  connect_and_home();
  begin_line();
  wait_in("<Run|MPos:-2.500,-1.000,0.000|FS:900,850>", 250ms);
  core.abort(now);
  ASSERT_TRUE(event<laser_event::Aborted>());
  EXPECT_THAT(event<laser_event::Aborted>()->stray_path, ::testing::IsEmpty());
}

TEST_F(GrblCoreTest, CountsEachOpeningOfTheLid) {
  connect_and_home();
  const int before = core.status().lid_openings;
  wait_in("<Door:1|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_EQ(core.status().lid_openings, before + 1);
  wait_in("<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_EQ(core.status().lid_openings, before + 1) << "closing is no opening";
  wait_in("<Door:2|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_EQ(core.status().lid_openings, before + 2);
  wait_in("<Door:3|MPos:-1.000,-1.000,0.000|FS:0,0>", 1s);
  wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_EQ(core.status().lid_openings, before + 2);
  // Opened and closed between two reports: the controller has latched it.
  wait_in("<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_EQ(core.status().lid_openings, before + 3);
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

TEST_F(GrblCoreTest, SaysSoWhenTheMachineDropsOutAtRest) {
  connect_and_home();
  EXPECT_EQ(say("ALARM:1\r\n[MSG:Reset to continue]\r\n"), "\x18");
  ASSERT_TRUE(event<laser_event::Fault>());
  EXPECT_TRUE(event<laser_event::Fault>()->connected);
  EXPECT_FALSE(core.status().homed);
}

// A panel is laid through the lid; closed again, the controller waits for a cycle start and takes no line before.
class ClosedLid : public GrblCoreTest {
 protected:
  static constexpr const char* kWaiting = "<Door:0|MPos:-1.000,-1.000,0.000|FS:0,0>";
  static constexpr const char* kIdle = "<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>";
  void SetUp() override {
    connect_and_home();
    wait_in("<Door:1|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
    EXPECT_EQ(wait_in(kWaiting, 2s), "") << "nothing resumes by itself";
  }
};

TEST_F(ClosedLid, IsLeftByAStartAndByNothingElse) {
  core.start(line_job(), now);
  EXPECT_EQ(out(), "~");
  core.start(line_job(), now);
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_EQ(event<laser_event::Failed>()->error.code, ErrorCode::kConflict);
  EXPECT_EQ(wait_in(kIdle, 200ms), "G0G17G21G91G94\nG0M4S0\nF900\n$G\n");
}

TEST_F(ClosedLid, ThatIsNotClosedAfterAllRefusesTheJob) {
  core.start(line_job(), now);
  EXPECT_EQ(out(), "~");
  EXPECT_EQ(wait_in("<Door:1|MPos:-1.000,-1.000,0.000|FS:0,0>", 20s), "");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("lid"));
  EXPECT_EQ(wait_in(kIdle, 2s), "") << "and it does not begin later";
}

TEST_F(ClosedLid, AStartThatIsHeldOrStoppedMeanwhileDoesNotBegin) {
  core.start(line_job(), now);
  out();
  core.hold(now);
  ASSERT_TRUE(event<laser_event::Held>());
  EXPECT_EQ(wait_in(kIdle, 2s), "");
  core.abort(now);
  EXPECT_EQ(out(), "\x18");
  say(kBanner);
  EXPECT_EQ(wait_in(kIdle, 2s), "");
  EXPECT_FALSE(event<laser_event::Aborted>()) << "no job ran";
}

TEST_F(ClosedLid, HomingResetsFirst) {
  core.home(now);
  EXPECT_EQ(out(), "\x18");
  say(kBanner);
  EXPECT_EQ(wait_in(kIdle, 500ms), "$H\n");
}

TEST_F(GrblCoreTest, HomingEndsAtTheFocusHeightAndNothingIsBurntElsewhere) {
  GrblOptions options;
  options.focus_z = Millimetres(-37.9);
  make_core(options);
  connect();
  core.home(now);
  ASSERT_EQ(out(), "$H\n");
  say("ok\r\n");
  EXPECT_EQ(wait_in("<Idle|MPos:-1.000,-1.000,-1.000|FS:0,0>", 200ms), "G21G53G0Z-37.900\n");
  say("ok\r\n");
  wait_in("<Idle|MPos:-1.000,-1.000,-1.000|FS:0,0>", 200ms);  // before the motion has begun
  wait_in("<Run|MPos:-1.000,-1.000,-20.000|FS:3000,0>", 200ms);
  EXPECT_FALSE(event<laser_event::Homed>());
  wait_in("<Idle|MPos:-1.000,-1.000,-37.900|FS:0,0>", 200ms);
  EXPECT_TRUE(event<laser_event::Homed>());
  wait_in("<Idle|MPos:-1.000,-1.000,-30.000|FS:0,0>", 1s);  // turned by hand at the machine
  core.start(line_job(), now);
  EXPECT_EQ(out(), "");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("focus height"));
}

TEST_F(GrblCoreTest, AFocusHeightThatIsNotReachedIsAFault) {
  GrblOptions options;
  options.focus_z = Millimetres(-37.9);
  make_core(options);
  connect();
  core.home(now);
  out();
  say("ok\r\n");
  wait_in("<Idle|MPos:-1.000,-1.000,-1.000|FS:0,0>", 200ms);
  say("error:15\r\n");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("focus height"));
  EXPECT_FALSE(core.status().homed);
}

TEST_F(GrblCoreTest, DoesNotHomeUnderAnOpenLid) {
  connect_and_home();
  wait_in("<Door:1|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  core.home(now);
  EXPECT_EQ(out(), "");
  ASSERT_TRUE(event<laser_event::Failed>());
  EXPECT_THAT(event<laser_event::Failed>()->error.message, HasSubstr("close it"));
}

TEST_F(GrblCoreTest, AnImpatientDoubleStopIsNotAFault) {
  connect_and_home();
  core.abort(now);
  out();
  say(kBanner);
  core.abort(now);
  out();
  say(kBanner);
  wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 2s);
  EXPECT_FALSE(event<laser_event::Fault>());
  EXPECT_TRUE(core.status().homed) << "a reset at rest keeps the position";
}

TEST_F(GrblCoreTest, WritesNoSettingEver) {
  connect_and_home();
  const std::string sent = begin_line();
  EXPECT_EQ(sent.find('='), std::string::npos);
  EXPECT_EQ(sent.find("$X"), std::string::npos) << "an alarm is never unlocked";
}

TEST_F(GrblCoreTest, SurvivesAnyAnswersInAnyOrder) {
  const std::vector<std::string> words = {"ok\r\n",
                                          "error:9\r\n",
                                          "ALARM:2\r\n",
                                          kBanner,
                                          "<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>\r\n",
                                          "<Run|MPos:-5.000,-1.000,0.000|FS:900,850>\r\n",
                                          "<Hold:0|MPos:-5.000,-1.000,0.000|FS:0,0>\r\n",
                                          "<Door:1|MPos:-5.000,-1.000,0.000>\r\n",
                                          "<Alarm>\r\n",
                                          "<Idle>\r\n",
                                          "<Idle|WPos:1,2,3|WCO:1,1,1>\r\n",
                                          "[GC:G1 G21 G91 G94 M4 F900 S850]\r\n",
                                          "[GC:]\r\n",
                                          "$130=\r\n",
                                          "<<>>[]$$=\r\n",
                                          std::string("\0\xff\x18", 3)};
  std::mt19937 random(3);
  for (int run = 0; run < 300; ++run) {
    make_core({});
    if (run % 3 == 0) {
      core.connect(now);
    } else {
      connect_and_home();
      if (run % 3 == 1) core.start(line_job(), now);
    }
    for (int i = 0; i < 60; ++i) {
      now += std::chrono::milliseconds(random() % 400);
      core.tick(now);
      switch (random() % 12) {
        case 0:
          core.hold(now);
          break;
        case 1:
          core.resume(now);
          break;
        case 2:
          core.start(line_job(), now);
          break;
        case 3:
          core.stop_after_piece();
          break;
        case 4:
          if (random() % 8 == 0) core.abort(now);
          break;
        default:
          core.receive(words[random() % words.size()], now);
      }
      const GrblOutput output = core.take_output();
      ASSERT_LE(core.queued_motion_s(), 1.0);
      if (!core.job_running()) {
        ASSERT_EQ(output.bytes.find("G1"), std::string::npos) << "burns without a job";
      }
      core.take_events();
    }
  }
}

}  // namespace
}  // namespace veneer::grbl
