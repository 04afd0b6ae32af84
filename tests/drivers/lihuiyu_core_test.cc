// The Lihuiyu driver on the simulated machine: what a sound machine does, what an operator can do to it.
#include "drivers/lihuiyu/lihuiyu_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/lihuiyu_cell.h"
#include "tests/support/lihuiyu_job.h"

namespace veneer {
namespace {

using lihuiyu::Board;
using lihuiyu::LihuiyuOptions;
using tests::LihuiyuCell;
using tests::odd_job;
using tests::wrong_piece;

TEST(LihuiyuCore, ConnectsWithoutMovingAnything) {
  LihuiyuCell cell;
  cell.board.set_consent(false);
  cell.connect();
  ASSERT_TRUE(cell.has<laser_event::Connected>());
  const LaserLimits limits = cell.first<laser_event::Connected>()->limits;
  EXPECT_EQ(limits.firmware, "Lihuiyu M2-Nano");
  EXPECT_EQ(limits.travel.max.x.count(), 300);
  EXPECT_EQ(limits.travel.max.y.count(), 200);
  cell.run(30);
  EXPECT_EQ(cell.board.log().moved_without_consent_mm, 0);
  EXPECT_THAT(cell.written, ::testing::ElementsAre(lihuiyu::reset_packet()));
  EXPECT_EQ(cell.core.status().state, "Ready");
  EXPECT_FALSE(cell.core.status().homed);
}

TEST(LihuiyuCore, SaysThatTheBoardHasNoPower) {
  LihuiyuCell cell;
  cell.board.power_off(cell.now());
  cell.connect();
  EXPECT_THAT(cell.failure().message, ::testing::HasSubstr("has no power"));
  EXPECT_FALSE(cell.has<laser_event::Connected>());
}

TEST(LihuiyuCore, RefusesAJobUntilHomedAndOneThatLeavesTheTravel) {
  LihuiyuCell cell;
  cell.connect();
  cell.start(odd_job(1));
  EXPECT_EQ(cell.failure().code, ErrorCode::kRefused);
  cell.events.clear();
  cell.home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  EXPECT_TRUE(cell.board.homed());
  EXPECT_FALSE(cell.board.moving());
  LaserJob outside = odd_job(1);
  outside.strokes[1].path[0] = point<MachineFrame>(300.1, 10);
  cell.start(outside);
  EXPECT_THAT(cell.failure().message, ::testing::HasSubstr("leaves the machine's travel"));
  EXPECT_THAT(cell.burns, ::testing::IsEmpty());
}

TEST(LihuiyuCore, BurnsEveryPieceAsPlanned) {
  for (const bool m3 : {false, true}) {
    LihuiyuOptions options;
    options.board = m3 ? Board::kM3 : Board::kM2;
    LihuiyuCell cell({.m3 = m3}, options);
    cell.connect_and_home();
    const LaserJob job = odd_job(3, m3 ? 0.6 : 1);
    std::size_t counted = 0, verified = 0;
    cell.on_step = [&] {
      for (; verified < cell.all<laser_event::PieceVerified>().size(); ++verified) {
        const PieceId piece = cell.all<laser_event::PieceVerified>()[verified].piece;
        EXPECT_EQ(wrong_piece(job, piece, std::span(cell.burns).subspan(counted)), "");
        counted = cell.burns.size();
      }
    };
    cell.start(job);
    cell.run_job();
    ASSERT_TRUE(cell.has<laser_event::Done>()) << cell.failure().message;
    EXPECT_EQ(verified, 3U);
    EXPECT_EQ(cell.all<laser_event::StrokeExecuted>().size(), job.strokes.size());
    EXPECT_THAT(cell.board.complaints(), ::testing::IsEmpty());
    const sim::BoardLog& log = cell.board.log();
    EXPECT_EQ(log.beam_at_rest_s, 0);
    EXPECT_EQ(log.burnt_unhomed_mm, 0);
    EXPECT_EQ(log.ground_mm, 0);
    EXPECT_LE(log.longest_queued_motion_s, 1.0);
    EXPECT_GT(log.longest_queued_motion_s, 0.2) << "the board is not kept fed";
    for (const sim::BurnSegment& burn : tests::moving(cell.burns)) {
      const double power = burn.power_seconds / std::chrono::duration<double>(burn.end - burn.start).count();
      ASSERT_NEAR(power, m3 ? 0.6 : 1, 0.01);
    }
  }
}

TEST(LihuiyuCore, KeepsTheBoardFed) {
  // A circle of many short runs at 100 mm/s: 4000 steps a second, and the beam never waits for packets.
  LihuiyuCell cell;
  cell.connect_and_home();
  LaserJob job = odd_job(1);
  Polyline<MachineFrame> circle;
  for (int k = 0; k <= 3600; ++k)
    circle.push_back(point<MachineFrame>(150 + 20 * std::cos(k * kPi / 1800), 100 + 20 * std::sin(k * kPi / 1800)));
  job.strokes = {{PieceId{1}, StrokeRole::kCut, circle, MmPerSecond(40), PowerFraction(1), 1}};
  cell.start(job);
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>()) << cell.failure().message;
  EXPECT_EQ(wrong_piece(job, PieceId{1}, cell.burns), "");
  double longest_gap = 0;
  for (std::size_t i = 1; i < cell.burns.size(); ++i)
    longest_gap =
        std::max(longest_gap, std::chrono::duration<double>(cell.burns[i].start - cell.burns[i - 1].end).count());
  EXPECT_LT(longest_gap, 1e-6);
}

TEST(LihuiyuCore, HoldsDarkAndGoesOnWhereItWas) {
  LihuiyuCell cell;
  cell.connect_and_home();
  const LaserJob job = odd_job(2, 1, 20);
  cell.start(job);
  cell.run(4);
  cell.core.hold(cell.now());
  cell.exchange();
  cell.run(10, [&] { return cell.has<laser_event::Held>(); });
  ASSERT_TRUE(cell.has<laser_event::Held>());
  EXPECT_FALSE(cell.board.moving());
  EXPECT_FALSE(cell.board.beam_commanded());
  const std::size_t burns = cell.burns.size();
  cell.run(60);
  EXPECT_EQ(cell.burns.size(), burns);
  EXPECT_FALSE(cell.over());
  cell.core.resume(cell.now());
  cell.exchange();
  EXPECT_TRUE(cell.has<laser_event::Resumed>());
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>()) << cell.failure().message;
  EXPECT_EQ(cell.board.log().beam_at_rest_s, 0);
}

TEST(LihuiyuCore, AbortStopsTheBeamAndForgetsThePosition) {
  LihuiyuCell cell;
  cell.connect_and_home();
  cell.start(odd_job(3, 1, 20));
  cell.run(3);
  ASSERT_TRUE(cell.board.beam_commanded());
  cell.core.abort(cell.now());
  cell.exchange();
  cell.run(0.3);
  EXPECT_FALSE(cell.board.beam_commanded());
  EXPECT_FALSE(cell.board.moving());
  const auto aborted = cell.first<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  EXPECT_EQ(aborted->error.code, ErrorCode::kCancelled);
  EXPECT_TRUE(aborted->position_lost);
  EXPECT_THAT(aborted->suspect, ::testing::ElementsAre(PieceId{1}));
  cell.events.clear();
  cell.board.set_consent(false);
  cell.run(20);
  cell.start(odd_job(1));
  EXPECT_EQ(cell.failure().code, ErrorCode::kRefused);
  EXPECT_EQ(cell.board.log().moved_without_consent_mm, 0);

  cell.board.set_consent(true);
  cell.events.clear();
  cell.burns.clear();
  cell.home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  const LaserJob job = odd_job(1);
  cell.start(job);
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>()) << cell.failure().message;
  EXPECT_EQ(wrong_piece(job, PieceId{1}, cell.burns), "");
}

TEST(LihuiyuCore, AHomingThatWaitsForAResetDoesNotBeginBehindAStop) {
  LihuiyuCell cell;
  cell.connect_and_home();
  cell.core.abort(cell.now());
  cell.core.home(cell.now());
  cell.core.abort(cell.now());
  cell.exchange();
  EXPECT_EQ(cell.failure().code, ErrorCode::kCancelled);
  cell.board.set_consent(false);
  cell.run(30);
  EXPECT_EQ(cell.board.log().moved_without_consent_mm, 0);
  EXPECT_FALSE(cell.core.status().homed);
}

TEST(LihuiyuCore, StopsAfterThePieceAndKeepsThePosition) {
  LihuiyuCell cell;
  cell.connect_and_home();
  const LaserJob job = odd_job(3);
  cell.start(job);
  cell.run(1);
  cell.core.stop_after_piece();
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_TRUE(cell.first<laser_event::Done>()->stopped_early);
  EXPECT_EQ(cell.all<laser_event::PieceVerified>().size(), 1U);
  cell.events.clear();
  cell.burns.clear();
  LaserJob rest;
  rest.strokes.assign(job.strokes.begin() + 2, job.strokes.end());
  cell.start(rest);
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_EQ(cell.all<laser_event::PieceVerified>().size(), 2U);
  EXPECT_LE(tests::one_sided_hausdorff(tests::planned_legs(job, PieceId{3}), tests::burnt_legs(cell.burns)),
            tests::kBurnTolerance);
}

TEST(LihuiyuCore, AnEndThatComesTooEarlyProvesNothing) {
  // A board that runs three times as fast as its speed code says has not been believed to do so.
  LihuiyuCell cell({.true_speed = 3});
  cell.connect_and_home();
  cell.start(odd_job(1, 1, 20));
  cell.run_job();
  EXPECT_THAT(cell.failure().message, ::testing::HasSubstr("has not executed all of it"));
  const auto aborted = cell.first<laser_event::Aborted>();
  EXPECT_THAT(aborted->suspect, ::testing::SizeIs(1));
  // Moves are relative: whatever it did instead, it did within the program's length of where that began.
  ASSERT_THAT(aborted->stray_path, ::testing::SizeIs(1));
  EXPECT_GT(aborted->stray_reach, Millimetres(20));
}

TEST(LihuiyuCore, WhenTheLinkDiesTheBeamDiesWithThePackets) {
  LihuiyuCell cell;
  cell.connect_and_home();
  cell.start(odd_job(1, 1, 20));
  cell.run(4);
  ASSERT_TRUE(cell.board.beam_commanded());
  cell.board.unplug();
  cell.run(2);
  EXPECT_FALSE(cell.board.beam_commanded());
  EXPECT_EQ(cell.board.log().beam_at_rest_s, 0);
  EXPECT_LE(cell.board.log().longest_queued_motion_s, 1.0);
  EXPECT_THAT(cell.first<laser_event::Aborted>()->suspect, ::testing::SizeIs(1));
  cell.board.plug();
  cell.reconnect();
  EXPECT_TRUE(cell.has<laser_event::Connected>());
  EXPECT_FALSE(cell.core.status().homed);
}

TEST(LihuiyuCore, SilenceAccusesTheComputerToo) {
  const lihuiyu::LihuiyuOptions options;
  LihuiyuCell cell({}, options);
  cell.connect_and_home();
  cell.start(odd_job(1, 1, 20));
  cell.run(4);
  cell.clock.advance(options.silence_timeout);
  cell.core.tick(cell.now());
  EXPECT_THAT(
      cell.core.take_events(),
      ::testing::Contains(::testing::VariantWith<laser_event::Aborted>(::testing::Field(
          &laser_event::Aborted::error,
          ::testing::Field(&Error::message, ::testing::AllOf(::testing::HasSubstr("the laser board stopped answering"),
                                                             ::testing::HasSubstr("this computer was too loaded"),
                                                             ::testing::HasSubstr("end other heavy programs")))))));
}

TEST(LihuiyuCore, HomingThatDoesNotEndAccusesTheComputerToo) {
  lihuiyu::LihuiyuOptions options;
  options.homing_timeout = options.homing_wait / 2;
  LihuiyuCell cell({}, options);
  cell.connect_and_home();
  ASSERT_TRUE(cell.has<laser_event::Failed>());
  EXPECT_THAT(cell.first<laser_event::Failed>()->error.message,
              ::testing::AllOf(::testing::HasSubstr("the laser did not finish homing in time"),
                               ::testing::HasSubstr("busy with something else"),
                               ::testing::HasSubstr("this computer was too loaded"),
                               ::testing::HasSubstr("end other heavy programs")));
}

TEST(LihuiyuCore, TellsOfALostSupplyWhileNothingRuns) {
  LihuiyuCell cell;
  cell.connect_and_home();
  cell.board.set_lid(true, cell.now());
  cell.run(3);
  ASSERT_TRUE(cell.has<laser_event::Fault>());
  EXPECT_THAT(cell.failure().message, ::testing::HasSubstr("lost its power"));
  EXPECT_FALSE(cell.core.status().homed);
  EXPECT_EQ(cell.core.status().state, "No power");
}

}  // namespace
}  // namespace veneer
