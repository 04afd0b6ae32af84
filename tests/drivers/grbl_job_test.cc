// Whole jobs on the simulated controller, with an operator who interferes.
#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/support/burn_check.h"
#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using tests::GrblCell;
using tests::square_job;
using tests::wrong_burn;

std::string whole_job_wrong(const LaserJob& job, const GrblCell& cell) {
  LaserJob one = job;
  for (Stroke& stroke : one.strokes) stroke.piece = PieceId{1};
  return wrong_burn(one, PieceId{1}, cell.bench.burns);
}

std::string ending(const GrblCell& cell) {
  if (const auto aborted = cell.first<laser_event::Aborted>()) return aborted->error.message;
  if (const auto failed = cell.first<laser_event::Failed>()) return failed->error.message;
  return cell.has<laser_event::Done>() ? "done" : "nothing";
}

TEST(GrblJob, BurnsExactlyThePlannedGeometry) {
  GrblCell cell;
  cell.connect_and_home();
  const LaserJob job = square_job(6);
  cell.start(job);
  cell.run_job();
  EXPECT_EQ(ending(cell), "done");
  EXPECT_EQ(whole_job_wrong(job, cell), "");
  EXPECT_THAT(cell.all<laser_event::PieceVerified>(), ::testing::SizeIs(6));
  EXPECT_THAT(cell.all<laser_event::StrokeExecuted>(), ::testing::SizeIs(18));
}

TEST(GrblJob, MovesNothingAndBurnsNothingWithoutConsent) {
  GrblCell cell;
  cell.bench.controller.set_consent(false);
  cell.connect();
  cell.run(30);
  EXPECT_TRUE(cell.has<laser_event::Connected>());
  cell.start(square_job(1));
  cell.run(10);
  EXPECT_EQ(cell.bench.controller.beam_log().moved_without_consent_mm, 0);
  for (const char c : std::string("GXYMFS")) EXPECT_EQ(cell.sent.find(std::string("\n") + c), std::string::npos) << c;
}

TEST(GrblJob, KeepsQueuedMotionBelowASecondWhateverTheStrokes) {
  // A long slow cut, a long fast line, an arc of hundreds of short lines, and a slow crawl.
  LaserJob job;
  const auto add = [&](Polyline<MachineFrame> path, double speed, double power) {
    job.strokes.push_back(
        {PieceId{}, StrokeRole::kPattern, std::move(path), MmPerSecond(speed), PowerFraction(power), 1});
  };
  add({point<MachineFrame>(10, 10), point<MachineFrame>(310, 40)}, 15, 0.85);
  add({point<MachineFrame>(10, 60), point<MachineFrame>(510, 60)}, 200, 0.2);
  Polyline<MachineFrame> arc;
  for (int i = 0; i <= 720; ++i)
    arc.push_back(point<MachineFrame>(200 + 20 * std::cos(i * kPi / 360), 200 + 20 * std::sin(i * kPi / 360)));
  add(arc, 80, 0.2);
  add({point<MachineFrame>(10, 300), point<MachineFrame>(12, 301)}, 0.5, 0.5);
  for (const double baud : {0.0, 115200.0}) {
    GrblCell cell(sim::GrblSettings::laser_cutter(), {.pace_baud = baud});
    cell.connect_and_home();
    cell.start(job);
    cell.run_job();
    EXPECT_EQ(ending(cell), "done");
    EXPECT_EQ(whole_job_wrong(job, cell), "");
    EXPECT_LE(cell.longest_queue_s, 1.0);
    EXPECT_LE(cell.bench.controller.beam_log().longest_queued_motion_s, 1.0);
    EXPECT_EQ(cell.bench.controller.beam_log().lost_bytes, 0U);
    EXPECT_FALSE(cell.has<laser_event::PieceVerified>()) << "a pattern belongs to no piece";
  }
}

TEST(GrblJob, IsNotStarvedByTheBoundOnQueuedMotion) {
  GrblCell cell(sim::GrblSettings::laser_cutter(), {.pace_baud = 115200});
  cell.connect_and_home();
  LaserJob job;
  job.strokes.push_back({PieceId{1},
                         StrokeRole::kCut,
                         {point<MachineFrame>(500, 370), point<MachineFrame>(200, 370)},
                         MmPerSecond(15),
                         PowerFraction(0.85),
                         1});
  const TimePoint begin = cell.now();
  cell.start(job);
  cell.run(60, [&] { return cell.over(); });
  EXPECT_EQ(ending(cell), "done");
  EXPECT_LT(std::chrono::duration<double>(cell.now() - begin).count(), 300 / 15.0 + 1.0);
}

TEST(GrblJob, ReportsAStrokeOnlyWhenItIsBurnt) {
  const LaserJob job = square_job(5);
  std::vector<double> planned_up_to;  // length of all strokes up to and with this one
  double sum = 0;
  for (const Stroke& stroke : job.strokes) {
    for (std::size_t i = 1; i < stroke.path.size(); ++i) sum += distance(stroke.path[i - 1], stroke.path[i]).count();
    planned_up_to.push_back(sum);
  }
  GrblCell cell;
  cell.connect_and_home();
  std::size_t seen = 0, strokes = 0;
  cell.on_step = [&] {
    for (; seen < cell.events.size(); ++seen) {
      const auto* executed = std::get_if<laser_event::StrokeExecuted>(&cell.events[seen]);
      if (executed == nullptr) continue;
      EXPECT_EQ(executed->stroke, strokes++) << "in order, none left out";
      EXPECT_GE(cell.bench.burnt_mm(), planned_up_to[executed->stroke] - 0.05);
    }
  };
  cell.start(job);
  cell.run_job();
  EXPECT_EQ(strokes, job.strokes.size());
}

TEST(GrblJob, HeldAndResumedAnywhereBurnsTheSame) {
  std::mt19937 random(11);
  for (int i = 0; i < 60; ++i) {
    GrblCell cell;
    cell.connect_and_home();
    const LaserJob job = square_job(2, 6);
    cell.start(job);
    for (int hold = 0; hold < 3 && !cell.over(); ++hold) {
      cell.run(std::uniform_real_distribution<double>(0.0, 2.5)(random), [&] { return cell.over(); });
      if (cell.over()) break;
      const auto held = cell.all<laser_event::Held>().size();
      cell.core.hold(cell.now());
      cell.exchange();
      cell.run(3, [&] { return cell.all<laser_event::Held>().size() > held; });
      ASSERT_EQ(cell.all<laser_event::Held>().size(), held + 1) << i;
      EXPECT_FALSE(cell.bench.controller.beam_on());
      EXPECT_FALSE(cell.bench.controller.moving());
      const double burnt = cell.bench.burnt_mm();
      cell.run(20);
      EXPECT_EQ(cell.bench.burnt_mm(), burnt) << "held is held";
      cell.core.resume(cell.now());
      cell.exchange();
    }
    cell.run_job();
    ASSERT_EQ(ending(cell), "done") << i;
    EXPECT_EQ(whole_job_wrong(job, cell), "") << i;
    EXPECT_EQ(cell.bench.controller.beam_log().beam_at_rest_s, 0);
  }
}

TEST(GrblJob, AbortedAnywhereIsDarkAtOnceAndNeedsHoming) {
  std::mt19937 random(12);
  for (int i = 0; i < 60; ++i) {
    GrblCell cell;
    cell.connect_and_home();
    cell.start(square_job(2, 6));
    cell.run(std::uniform_real_distribution<double>(0.0, 6.0)(random), [&] { return cell.over(); });
    if (cell.over()) continue;
    const bool burning = cell.bench.controller.beam_on();
    cell.core.abort(cell.now());
    cell.exchange();
    EXPECT_FALSE(cell.bench.controller.beam_on());
    EXPECT_FALSE(cell.bench.controller.moving());
    const auto aborted = cell.first<laser_event::Aborted>();
    ASSERT_TRUE(aborted);
    EXPECT_EQ(aborted->error.code, ErrorCode::kCancelled);
    EXPECT_TRUE(aborted->position_lost);
    if (burning) {
      EXPECT_THAT(aborted->suspect, ::testing::SizeIs(1));
    }
    const double burnt = cell.bench.burnt_mm();
    cell.run(10);
    EXPECT_EQ(cell.bench.burnt_mm(), burnt);
    cell.events.clear();
    cell.start(square_job(1));
    EXPECT_THAT(ending(cell), ::testing::HasSubstr("Stop, then Reset"));
  }
}

TEST(GrblJob, AbortedWhileHeldKeepsItsPosition) {
  GrblCell cell;
  cell.connect_and_home();
  cell.start(square_job(1, 6));
  cell.run(2.5);
  cell.core.hold(cell.now());
  cell.exchange();
  cell.run(3, [&] { return cell.has<laser_event::Held>(); });
  cell.core.abort(cell.now());
  cell.exchange();
  ASSERT_TRUE(cell.has<laser_event::Aborted>());
  EXPECT_FALSE(cell.first<laser_event::Aborted>()->position_lost);
  EXPECT_TRUE(cell.bench.controller.homed());
}

TEST(GrblJob, StopsAfterThePieceWhenAsked) {
  GrblCell cell;
  cell.connect_and_home();
  cell.start(square_job(4, 6));
  cell.run(600, [&] { return cell.has<laser_event::PieceVerified>(); });
  cell.core.stop_after_piece();
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_TRUE(cell.first<laser_event::Done>()->stopped_early);
  EXPECT_THAT(cell.all<laser_event::PieceVerified>(), ::testing::SizeIs(2));
  EXPECT_FALSE(cell.bench.controller.beam_on());
}

TEST(GrblJob, RunsOneJobAfterTheOther) {
  GrblCell cell;
  cell.connect_and_home();
  for (int i = 0; i < 5; ++i) {
    cell.events.clear();
    cell.bench.burns.clear();
    const LaserJob job = square_job(1, 6, 40.0 + 8 * i);
    cell.start(job);
    cell.run(60, [&] { return cell.over(); });
    ASSERT_EQ(ending(cell), "done") << i;
    EXPECT_EQ(whole_job_wrong(job, cell), "");
  }
}

TEST(GrblJob, CutsInAsManyPassesAsAsked) {
  GrblCell cell;
  cell.connect_and_home();
  LaserJob job = square_job(1, 6);
  const double once = [&] {
    double sum = 0;
    for (const Stroke& stroke : job.strokes)
      for (std::size_t i = 1; i < stroke.path.size(); ++i) sum += distance(stroke.path[i - 1], stroke.path[i]).count();
    return sum;
  }();
  for (Stroke& stroke : job.strokes) stroke.passes = 3;
  cell.start(job);
  cell.run_job();
  EXPECT_EQ(ending(cell), "done");
  EXPECT_NEAR(cell.bench.burnt_mm(), 3 * once, 0.1);
}

// Shorter than four motor steps each: single precision alone would be a step off by the end of a row.
TEST(GrblJob, ThousandsOfShortMovesEndWhereTheyShould) {
  Stroke stroke{PieceId{1}, StrokeRole::kEngrave, {}, MmPerSecond(100), PowerFraction(0.3), 1};
  for (int i = 0; i <= 15000; ++i) stroke.path.push_back(point<MachineFrame>(60 + 0.02 * i, 40 + 0.02 * (i / 2 % 2)));
  GrblCell cell;
  cell.connect_and_home();
  cell.start(LaserJob{{stroke}});
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
}

}  // namespace
}  // namespace veneer
