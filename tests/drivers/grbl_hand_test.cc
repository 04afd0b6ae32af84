// What an operator does by hand: jogging, overrides, a dry reading of a job in check mode, a machine without switches.
#include <gmock/gmock.h>

#include <string>

#include "drivers/grbl/overrides.h"
#include "tests/support/burn_check.h"
#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using tests::GrblCell;
using tests::square_job;

class GrblHandTest : public ::testing::Test {
 protected:
  void home() {
    cell.connect_and_home();
    cell.events.clear();
    cell.sent.clear();
  }
  Status jog(double dx, double dy, double speed = 50) {
    const Status taken = cell.core.jog(Millimetres(dx), Millimetres(dy), MmPerSecond(speed), cell.now());
    cell.exchange();
    return taken;
  }
  void run_jog() {
    cell.run(60, [this] { return cell.has<laser_event::JogEnded>(); });
  }
  Status check(const LaserJob& job) {
    const Status taken = cell.core.check(job, cell.now());
    cell.exchange();
    return taken;
  }
  Status turn(const LaserOverrides& overrides) {
    const Status taken = cell.core.set_overrides(overrides, cell.now());
    cell.exchange();
    return taken;
  }
  const sim::BeamLog& log() const { return cell.bench.controller.beam_log(); }

  GrblCell cell;
};

// ---- jog

TEST_F(GrblHandTest, JogsDarkInBoundedPiecesAndEndsWhereItWasSent) {
  home();
  const auto from = cell.core.status().position;
  ASSERT_TRUE(jog(-120, -33.5));
  run_jog();
  ASSERT_TRUE(cell.has<laser_event::JogEnded>());
  EXPECT_FALSE(cell.first<laser_event::JogEnded>()->error);
  EXPECT_NEAR(cell.core.status().position.x.count(), from.x.count() - 120, 0.02);
  EXPECT_NEAR(cell.core.status().position.y.count(), from.y.count() - 33.5, 0.02);
  EXPECT_THAT(cell.sent, HasSubstr("$J=G91G21X-"));
  EXPECT_EQ(log().beam_on_s, 0);
  EXPECT_LE(log().longest_queued_motion_s, 1.0);
  cell.start(square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>()) << "a job runs after a jog";
}

TEST_F(GrblHandTest, StopsAJogAndStaysThere) {
  home();
  ASSERT_TRUE(jog(-200, 0, 40));
  cell.run(1.0);
  cell.core.stop_jog(cell.now());
  cell.exchange();
  run_jog();
  ASSERT_TRUE(cell.has<laser_event::JogEnded>());
  const double x = cell.core.status().position.x.count();
  EXPECT_GT(x, 519 - 60);
  EXPECT_LT(x, 519 - 20);
  cell.run(5);
  EXPECT_EQ(cell.core.status().position.x.count(), x);
  EXPECT_TRUE(cell.core.status().homed);
}

TEST_F(GrblHandTest, RefusesJogsThatLeaveTheTravelOrComeAtTheWrongTime) {
  cell.connect();
  EXPECT_EQ(jog(1, 0).error().code, ErrorCode::kRefused) << "locked until homed";
  home();
  EXPECT_THAT(jog(5, 0).error().message, HasSubstr("x 0.0 to 519.0 mm"));
  EXPECT_EQ(jog(1000, 0).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(jog(-1, 0, 1000).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(cell.sent.find('J'), std::string::npos);
  cell.start(square_job(1));
  EXPECT_EQ(jog(-1, 0).error().code, ErrorCode::kConflict) << "not during a job";
}

TEST_F(GrblHandTest, StopDuringAJogLosesThePosition) {
  home();
  ASSERT_TRUE(jog(-200, 0, 40));
  cell.run(1.0);
  cell.core.abort(cell.now());
  cell.exchange();
  EXPECT_FALSE(cell.bench.controller.moving());
  ASSERT_TRUE(cell.has<laser_event::JogEnded>());
  EXPECT_TRUE(cell.first<laser_event::JogEnded>()->error);
  cell.run(2);
  EXPECT_FALSE(cell.core.status().homed);
}

TEST_F(GrblHandTest, OverridesAskedForInAJogComeWhenTheHeadRests) {
  home();
  ASSERT_TRUE(jog(-60, 0));
  ASSERT_TRUE(turn({100, 100, 90}));
  EXPECT_EQ(cell.sent.find('\x9B'), std::string::npos);
  run_jog();
  cell.run(5, [this] { return cell.sent.find('\x9B') != std::string::npos; });
  EXPECT_THAT(cell.sent, HasSubstr("\x9B"));
}

TEST_F(GrblHandTest, AnOpenedLidEndsAJog) {
  home();
  ASSERT_TRUE(jog(-200, 0, 40));
  cell.run(1.0);
  cell.bench.controller.set_lid(true, cell.now());
  run_jog();
  ASSERT_TRUE(cell.has<laser_event::JogEnded>());
  EXPECT_THAT(cell.first<laser_event::JogEnded>()->error->message, HasSubstr("lid"));
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(5);
  EXPECT_FALSE(cell.bench.controller.moving());
}

// ---- check mode

TEST_F(GrblHandTest, ReadsAJobInCheckModeWithoutMoving) {
  home();
  cell.bench.controller.set_consent(false);
  ASSERT_TRUE(check(square_job(4)));
  cell.run(30, [this] { return cell.has<laser_event::Checked>() || cell.has<laser_event::Failed>(); });
  EXPECT_TRUE(cell.has<laser_event::Checked>());
  EXPECT_THAT(cell.sent, HasSubstr("S850"));
  EXPECT_EQ(log().moved_without_consent_mm, 0);
  EXPECT_EQ(log().beam_on_s, 0);
  EXPECT_EQ(log().lost_bytes, 0U);
  EXPECT_TRUE(cell.core.status().homed);
  cell.bench.controller.set_consent(true);
  cell.start(square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>()) << "the job itself follows";
}

TEST_F(GrblHandTest, NamesTheLineTheControllerWouldRefuse) {
  home();
  cell.bench.controller.inject({sim::FaultKind::kError, 12, 33});
  ASSERT_TRUE(check(square_job(2)));
  cell.run(30, [this] { return cell.has<laser_event::Checked>() || cell.has<laser_event::Failed>(); });
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  EXPECT_THAT(cell.first<laser_event::Failed>()->error.message, HasSubstr("error:33 of Grbl"));
  cell.run(2);
  EXPECT_EQ(cell.bench.controller.state(), "Idle");
  EXPECT_TRUE(cell.core.status().homed);
}

TEST_F(GrblHandTest, SendsNoLineOfACheckToAControllerThatIsNotInCheckMode) {
  home();
  cell.bench.controller.set_consent(false);
  // "$C" loses a byte on its way: the controller prints its help and says ok.
  cell.bench.controller.inject({sim::FaultKind::kDropByte, 2});
  ASSERT_TRUE(check(square_job(2)));
  cell.run(30, [this] { return cell.has<laser_event::Checked>() || cell.has<laser_event::Failed>(); });
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  EXPECT_EQ(cell.sent.find('X'), std::string::npos);
  EXPECT_EQ(log().moved_without_consent_mm, 0);
}

// ---- overrides

TEST(GrblFocus, IsMovedToBehindHomingAndAJobRunsThere) {
  grbl::GrblOptions options;
  options.focus_z = Millimetres(-12.5);
  tests::GrblCell cell(sim::GrblSettings::laser_cutter(), {}, options);
  cell.connect_and_home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  EXPECT_THAT(cell.received, ::testing::HasSubstr(",-12.500"));
  cell.start(tests::square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
}

TEST(Overrides, TakeOneStepAtATimeAndWaitToSeeIt) {
  grbl::Overrides overrides;
  ASSERT_TRUE(overrides.want({79, 50, 111}));
  EXPECT_EQ(overrides.next_step(), "\x92\x96") << "power, which follows the speed, rises behind it";
  EXPECT_EQ(overrides.next_step(), "") << "two bytes of a kind that arrive together count once";
  EXPECT_TRUE(overrides.reported({100, 100, 100})) << "asked before the step was taken";
  EXPECT_EQ(overrides.next_step(), "\x92\x96");
  EXPECT_TRUE(overrides.reported({90, 50, 100}));
  EXPECT_EQ(overrides.next_step(), "\x92");
  EXPECT_TRUE(overrides.reported({80, 50, 100}));
  EXPECT_EQ(overrides.next_step(), "\x94");
  EXPECT_TRUE(overrides.reported({79, 50, 100}));
  EXPECT_EQ(overrides.next_step(), "\x9A");
  EXPECT_TRUE(overrides.reported({79, 50, 110}));
  EXPECT_EQ(overrides.next_step(), "\x9C");
  EXPECT_TRUE(overrides.reported({79, 50, 111}));
  EXPECT_TRUE(overrides.settled());
  EXPECT_DOUBLE_EQ(overrides.slowest(), 0.5);
  EXPECT_FALSE(overrides.reported({79, 50, 121})) << "not by us";
  ASSERT_TRUE(overrides.want({}));
  EXPECT_EQ(overrides.next_step(), "\x99\x95");
  EXPECT_TRUE(overrides.reported({79, 100, 100}));
  EXPECT_EQ(overrides.next_step(), "\x90");
  EXPECT_FALSE(overrides.want({24, 100, 100}));
  EXPECT_FALSE(overrides.want({100, 60, 100}));
  EXPECT_FALSE(overrides.want({100, 100, 201}));
}

TEST_F(GrblHandTest, SlowsAJobDownWithoutQueuingMoreThanASecond) {
  home();
  const LaserJob job = square_job(3, 30);
  cell.start(job);
  cell.run(2.0);
  ASSERT_TRUE(turn({30, 25, 80}));
  cell.run(6);
  EXPECT_EQ(cell.core.status().overrides, (LaserOverrides{30, 25, 80}));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
  EXPECT_LE(log().longest_queued_motion_s, 1.0);
  EXPECT_LE(cell.longest_queue_s, 1.0);
}

TEST_F(GrblHandTest, KeepsOverridesFromJobToJobAndDropsThemWithAReset) {
  home();
  ASSERT_TRUE(turn({120, 100, 90}));
  cell.run(3);
  EXPECT_EQ(cell.core.status().overrides, (LaserOverrides{120, 100, 90}));
  cell.start(square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
  EXPECT_EQ(cell.core.status().overrides, (LaserOverrides{120, 100, 90}));
  cell.core.abort(cell.now());
  cell.exchange();
  cell.run(3);
  EXPECT_EQ(cell.core.status().overrides, LaserOverrides{});
}

TEST_F(GrblHandTest, OverridesAreTakenQuicklyAtRestAndTheLastRequestIsKnownAtOnce) {
  home();
  ASSERT_TRUE(turn({100, 100, 50}));
  EXPECT_EQ(cell.core.status().overrides_wanted, (LaserOverrides{100, 100, 50})) << "for who adds to it";
  ASSERT_TRUE(turn({150, 100, cell.core.status().overrides_wanted.power}));
  cell.run(2.2);
  EXPECT_EQ(cell.core.status().overrides, (LaserOverrides{150, 100, 50})) << "ten steps, not half a second each";
}

TEST_F(GrblHandTest, AJobBeginsWhenItsOverridesAreReached) {
  home();
  ASSERT_TRUE(turn({100, 100, 50}));
  std::optional<LaserOverrides> at_begin;
  cell.on_wire = [&](const std::string& bytes) {
    if (!at_begin && bytes.find("G17") != std::string::npos) at_begin = cell.core.status().overrides;
  };
  cell.start(square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
  ASSERT_TRUE(at_begin);
  EXPECT_EQ(at_begin->power, 50);
}

// ---- a lid that was opened at rest

TEST_F(GrblHandTest, WhatALidThatIsClosedAgainIsInTheWayOfSaysNothingOfClosingIt) {
  home();
  cell.bench.controller.set_lid(true, cell.now());
  cell.run(2);
  EXPECT_THAT(jog(-5, 0).error().message, HasSubstr("close the lid"));
  EXPECT_THAT(check(square_job(1)).error().message, HasSubstr("close the lid"));
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(2);
  ASSERT_EQ(cell.core.status().state, "Door:0");
  EXPECT_THAT(check(square_job(1)).error().message,
              AllOf(HasSubstr("Door:0"), Not(HasSubstr("lid")), HasSubstr(": Stop, then Reset")));
}

// After its lid was closed a controller waits in Door:0 for a cycle start. Nothing is queued: a jog is an operator's
// word.
class JogAfterTheLid : public GrblHandTest {
 protected:
  void SetUp() override {
    home();
    cell.bench.controller.set_lid(true, cell.now());
    cell.run(2);
    cell.bench.controller.set_lid(false, cell.now());
    cell.run(2);
    ASSERT_EQ(cell.core.status().state, "Door:0");
    from = cell.core.status().position;
  }
  std::optional<Error> ended() {
    run_jog();
    const auto end = cell.first<laser_event::JogEnded>();
    EXPECT_TRUE(end);
    return end ? end->error : std::nullopt;
  }
  double moved() const { return from.x.count() - cell.core.status().position.x.count(); }
  Point<MachineFrame> from;
};

TEST_F(JogAfterTheLid, GoesDarkToWhereItIsSent) {
  ASSERT_TRUE(jog(-30, 0));
  const auto error = ended();
  EXPECT_FALSE(error) << error->message;
  EXPECT_NEAR(moved(), 30, 0.02);
  EXPECT_TRUE(cell.bench.burns.empty());
  cell.start(square_job(1));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>()) << "and a job may begin";
}

TEST_F(JogAfterTheLid, IsRefusedAtOnceWhereItWouldLeaveTheTravel) {
  EXPECT_THAT(jog(30, 0).error().message, HasSubstr("leaves the travel"));
  EXPECT_EQ(cell.core.status().state, "Door:0") << "and nothing is woken for it";
}

TEST_F(JogAfterTheLid, ThatIsStoppedBeforeTheControllerWakesNeverMoves) {
  ASSERT_TRUE(cell.core.jog(Millimetres(-30), Millimetres(0), MmPerSecond(50), cell.now()));
  cell.core.stop_jog(cell.now());
  cell.exchange();
  EXPECT_FALSE(ended());
  cell.run(5);
  EXPECT_NEAR(moved(), 0, 1e-6);
}

TEST_F(JogAfterTheLid, NeverMovesBehindAStop) {
  ASSERT_TRUE(cell.core.jog(Millimetres(-30), Millimetres(0), MmPerSecond(50), cell.now()));
  cell.core.abort(cell.now());
  cell.exchange();
  ASSERT_TRUE(ended());
  cell.run(5);
  EXPECT_NEAR(moved(), 0, 1e-6);
}

TEST_F(JogAfterTheLid, EndsWithAWordOnceTheLidIsOpenAgain) {
  ASSERT_TRUE(cell.core.jog(Millimetres(-30), Millimetres(0), MmPerSecond(50), cell.now()));
  cell.bench.controller.set_lid(true, cell.now());
  cell.exchange();
  const auto error = ended();
  ASSERT_TRUE(error);
  EXPECT_THAT(error->message, HasSubstr("lid"));
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(5);
  EXPECT_NEAR(moved(), 0, 1e-6);
}

// ---- a lid over a pattern, which is nobody's piece

TEST_F(GrblHandTest, ALidOpenedOverAPatternIsRemarkedAndNothingIsAborted) {
  home();
  LaserJob pattern = square_job(1, 40);
  for (Stroke& stroke : pattern.strokes) stroke.piece = PieceId{};
  cell.start(pattern);
  cell.run(3);
  cell.bench.controller.set_lid(true, cell.now());
  cell.run(2);
  EXPECT_TRUE(cell.core.status().lid_open.value_or(false));
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(1);
  EXPECT_EQ(cell.core.status().state, "Door:0");
  EXPECT_FALSE(cell.core.status().lid_open.value_or(true)) << "it waits, but the lid is closed";
  cell.core.resume(cell.now());
  cell.exchange();
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_THAT(cell.first<laser_event::Done>()->remark, HasSubstr("there may be a gap in the cut before ("));
}

TEST_F(GrblHandTest, ALidOpenedOverADryRunLeavesNoGap) {
  home();
  LaserJob dry = square_job(1, 40);
  for (Stroke& stroke : dry.strokes) stroke.power = PowerFraction(0);
  cell.start(dry);
  cell.run(3);
  cell.bench.controller.set_lid(true, cell.now());
  cell.run(2);
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(1);
  cell.core.resume(cell.now());
  cell.exchange();
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_EQ(cell.first<laser_event::Done>()->remark, "");
}

// ---- a machine without switches

class NoSwitches : public ::testing::Test {
 protected:
  static sim::GrblSettings settings() {
    sim::GrblSettings settings = sim::GrblSettings::laser_cutter(300, 200);
    settings.set(20, 0);
    settings.set(22, 0);
    return settings;
  }
  void home() {
    cell.events.clear();
    cell.core.home(cell.now());
    cell.exchange();
    cell.run(30, [this] { return cell.has<laser_event::Homed>() || cell.has<laser_event::Failed>(); });
  }
  void expect_at_corner() {
    const auto at = cell.core.status().position;
    EXPECT_NEAR(at.x.count(), 0, 0.02);
    EXPECT_NEAR(at.y.count(), 0, 0.02);
  }
  GrblCell cell{settings()};
};

TEST_F(NoSwitches, TellNothingOfALidUntilOneIsSeen) {
  sim::GrblOptions options;
  options.door_pin = false;
  GrblCell bare(settings(), options);
  bare.connect();
  EXPECT_EQ(bare.core.status().lid_open, std::nullopt);
  cell.connect();
  EXPECT_EQ(cell.core.status().lid_open, false);
}

TEST_F(NoSwitches, EachResetKeepsTheCornerAndBringsTheHeadBackToIt) {
  cell.connect();
  home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  for (int i = 0; i < 3; ++i) {
    cell.start(square_job(1, 8, 5, 5));
    cell.run_job();
    ASSERT_TRUE(cell.has<laser_event::Done>());
    home();
    ASSERT_TRUE(cell.has<laser_event::Homed>());
    expect_at_corner();
  }
}

TEST_F(NoSwitches, StopsAndResetsDoNotWander) {
  cell.connect();
  home();
  for (int i = 0; i < 8; ++i) {
    cell.start(square_job(1, 40, 100, 120));
    cell.run(2);
    cell.core.abort(cell.now());
    cell.exchange();
    cell.run(3);
    home();
    ASSERT_TRUE(cell.has<laser_event::Homed>());
    expect_at_corner();
  }
  cell.start(square_job(1, 40, 100, 180));
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  EXPECT_THAT(cell.first<laser_event::Failed>()->error.message, HasSubstr("leaves the machine's travel"));
}

TEST_F(NoSwitches, AControllerThatForgotIsAskedAboutAndTheOperatorsWordCounts) {
  cell.connect();
  home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  cell.bench.controller.inject({sim::FaultKind::kBanner, 1});
  ASSERT_TRUE(cell.core.jog(Millimetres(30), Millimetres(20), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(5);
  EXPECT_FALSE(cell.core.status().homed);
  cell.bench.controller.set_consent(false);
  home();
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  EXPECT_THAT(cell.first<laser_event::Failed>()->error.message,
              HasSubstr("say veneerctl laser here, then Clear and Reset"));
  EXPECT_EQ(cell.bench.controller.beam_log().moved_without_consent_mm, 0);
  ASSERT_TRUE(cell.core.corner_is_here(cell.now()));
  home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  expect_at_corner();
}

// The head stands to the right of the corner and behind it, which a corner that were taken here would forbid to leave.
TEST_F(NoSwitches, AForgottenCornerIsReachedByAJogToAnySide) {
  cell.connect();
  home();
  ASSERT_TRUE(cell.core.jog(Millimetres(30), Millimetres(20), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(20, [&] { return cell.has<laser_event::JogEnded>(); });
  cell.bench.controller.inject({sim::FaultKind::kBanner, 1});
  ASSERT_TRUE(cell.core.jog(Millimetres(1), Millimetres(0), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(5);
  home();
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  cell.events.clear();
  const auto before = cell.core.status().position;
  ASSERT_TRUE(cell.core.jog(Millimetres(-30), Millimetres(-20), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(20, [&] { return cell.has<laser_event::JogEnded>(); });
  ASSERT_TRUE(cell.has<laser_event::JogEnded>());
  EXPECT_FALSE(cell.first<laser_event::JogEnded>()->error);
  EXPECT_NEAR(before.x.count() - cell.core.status().position.x.count(), 30, 0.02);
  EXPECT_NEAR(before.y.count() - cell.core.status().position.y.count(), 20, 0.02);
  ASSERT_TRUE(cell.core.corner_is_here(cell.now()));
  home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  expect_at_corner();
}

TEST_F(NoSwitches, TheCornerIsWhereTheOperatorSaysAfterAJog) {
  cell.connect();
  home();
  ASSERT_TRUE(cell.core.jog(Millimetres(30), Millimetres(20), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(20, [&] { return cell.has<laser_event::JogEnded>(); });
  ASSERT_TRUE(cell.core.corner_is_here(cell.now()));
  expect_at_corner();
  home();
  expect_at_corner();
}

TEST_F(GrblHandTest, AMachineWithSwitchesNeedsNobodyToNameItsCorner) {
  home();
  EXPECT_EQ(cell.core.corner_is_here(cell.now()).error().code, ErrorCode::kRefused);
}

TEST(GrblWithoutSwitches, TakesThePlaceOfItsHeadAsTheCornerWhenTheOperatorSaysSo) {
  sim::GrblSettings settings = sim::GrblSettings::laser_cutter(520, 380);
  settings.set(20, 0);
  settings.set(22, 0);
  GrblCell cell(settings);
  cell.connect();
  ASSERT_TRUE(cell.has<laser_event::Connected>());
  EXPECT_FALSE(cell.first<laser_event::Connected>()->limits.finds_home);
  cell.start(square_job(1));
  EXPECT_TRUE(cell.has<laser_event::Failed>()) << "nobody has said where the head stands";
  cell.events.clear();
  ASSERT_TRUE(cell.core.jog(Millimetres(-20), Millimetres(-10), MmPerSecond(50), cell.now()));
  cell.exchange();
  cell.run(20, [&] { return cell.has<laser_event::JogEnded>(); });

  cell.bench.controller.put_head({-500, -370});
  cell.bench.controller.set_consent(false);
  cell.core.home(cell.now());
  cell.exchange();
  cell.run(5);
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  EXPECT_EQ(cell.bench.controller.beam_log().moved_without_consent_mm, 0) << "nothing moves";
  EXPECT_NEAR(cell.core.status().position.x.count(), 0, 1e-9);
  EXPECT_NEAR(cell.core.status().position.y.count(), 0, 1e-9);

  cell.bench.controller.set_consent(true);
  cell.start(square_job(1, 12, 5, 5));
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
  ASSERT_FALSE(cell.bench.burns.empty());
  EXPECT_NEAR(cell.bench.burns.front().from.x_mm, -500 + 8, 0.05);
}

TEST(GrblWithoutSwitches, IsUnlockedAfterAStopOnlyByTheOperatorsHoming) {
  sim::GrblSettings settings = sim::GrblSettings::laser_cutter();
  settings.set(20, 0);
  settings.set(22, 0);
  GrblCell cell(settings);
  cell.connect_and_home();
  cell.start(square_job(2));
  cell.run(1.5);
  cell.core.abort(cell.now());
  cell.exchange();
  cell.run(5);
  EXPECT_FALSE(cell.core.status().homed);
  EXPECT_EQ(cell.sent.find("$X", cell.sent.rfind('\x18')), std::string::npos);
  cell.events.clear();
  cell.core.home(cell.now());
  cell.exchange();
  cell.run(5);
  EXPECT_TRUE(cell.has<laser_event::Homed>());
  EXPECT_EQ(cell.bench.controller.state(), "Idle");
}

}  // namespace
}  // namespace veneer
