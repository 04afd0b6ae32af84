// The core against a script, at rest: connecting, homing, the lid, and answers no simulator would give.
#include <gmock/gmock.h>

#include <random>
#include <string>
#include <vector>

#include "tests/drivers/grbl_core_fixture.h"

namespace veneer::grbl {
namespace {

using ::testing::HasSubstr;

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
