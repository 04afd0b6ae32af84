// Hold at any moment of a job, its last one and the one after it among them: both families, on clocks that stand still.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/burn_check.h"
#include "tests/support/grbl_cell.h"
#include "tests/support/lihuiyu_cell.h"
#include "tests/support/lihuiyu_job.h"

namespace veneer {
namespace {

using tests::GrblCell;
using tests::LihuiyuCell;

LaserJob grbl_job() { return tests::square_job(1, 4); }
LaserJob lihuiyu_job() { return tests::odd_job(1); }

// Its length in seconds, from start() to Done.
template <class Cell>
double length_of(const LaserJob& job) {
  Cell cell;
  cell.connect_and_home();
  const TimePoint begin = cell.now();
  cell.start(job);
  cell.run(600, [&] { return cell.over(); });
  return std::chrono::duration<double>(cell.now() - begin).count();
}

// What is wrong with a hold `at` seconds after the start, "" when nothing is.
template <class Cell>
std::string hold_at(double at, const LaserJob& job, bool twice) {
  Cell cell;
  cell.connect_and_home();
  cell.events.clear();
  cell.start(job);
  cell.run(at);
  const bool was_over = cell.over();
  cell.core.hold(cell.now());
  cell.exchange();
  if (twice) {
    cell.run(0.05);
    cell.core.hold(cell.now());
    cell.exchange();
  }
  cell.run(30);
  if (!cell.template has<laser_event::Held>()) return "the hold was lost";
  if (!was_over && cell.template all<laser_event::Held>().size() != 1)
    return "it was told more than once that it holds";
  if (!was_over && cell.over()) return "the job ended while it was held";
  if (was_over) return {};
  cell.core.resume(cell.now());
  cell.exchange();
  cell.run(600, [&] { return cell.over(); });
  cell.run(3);
  if (!cell.template has<laser_event::Done>()) return "the job did not go on";
  if (cell.template all<laser_event::Done>().size() != 1) return "the job ended more than once";
  if (cell.template all<laser_event::StrokeExecuted>().size() != job.strokes.size()) return "a stroke is missing";
  if (cell.template all<laser_event::PieceVerified>().size() != 1) return "the piece is not verified";
  return {};
}

TEST(Hold, IsNeverLostInTheLastSecondsOfAGrblPieceOrBehindIt) {
  const double length = length_of<GrblCell>(grbl_job());
  for (double at = std::max(0.0, length - 1.2); at < length + 0.02; at += 0.007)
    ASSERT_EQ(hold_at<GrblCell>(at, grbl_job(), false), "") << at << " s of " << length;
}

TEST(Hold, IsNeverLostInTheLastSecondsOfALihuiyuPieceOrBehindIt) {
  const double length = length_of<LihuiyuCell>(lihuiyu_job());
  for (double at = std::max(0.0, length - 3); at < length + 0.02; at += 0.017)
    ASSERT_EQ(hold_at<LihuiyuCell>(at, lihuiyu_job(), false), "") << at << " s of " << length;
}

TEST(Hold, TwiceIsHarmless) {
  const double grbl = length_of<GrblCell>(grbl_job()), lihuiyu = length_of<LihuiyuCell>(lihuiyu_job());
  for (int i = 0; i < 60; ++i) {
    ASSERT_EQ(hold_at<GrblCell>(grbl * i / 60, grbl_job(), true), "") << grbl * i / 60 << " s of " << grbl;
    ASSERT_EQ(hold_at<LihuiyuCell>(lihuiyu * i / 60, lihuiyu_job(), true), "") << lihuiyu * i / 60 << " of " << lihuiyu;
  }
}

TEST(Hold, InTheSameTurnAsDoneIsAnswered) {
  GrblCell grbl;
  grbl.connect_and_home();
  grbl.start(grbl_job());
  grbl.run(600, [&] { return grbl.over(); });
  ASSERT_TRUE(grbl.has<laser_event::Done>());
  grbl.core.hold(grbl.now());
  grbl.exchange();
  EXPECT_TRUE(grbl.has<laser_event::Held>());

  LihuiyuCell lihuiyu;
  lihuiyu.connect_and_home();
  lihuiyu.start(lihuiyu_job());
  lihuiyu.run(600, [&] { return lihuiyu.over(); });
  ASSERT_TRUE(lihuiyu.has<laser_event::Done>());
  lihuiyu.core.hold(lihuiyu.now());
  lihuiyu.exchange();
  EXPECT_TRUE(lihuiyu.has<laser_event::Held>());
}

TEST(Hold, BeforeAJobThatWaitsForTheLidToBeForgottenKeepsItWaiting) {
  GrblCell cell;
  cell.connect_and_home();
  cell.bench.controller.set_lid(true, cell.now());
  cell.run(1);
  cell.bench.controller.set_lid(false, cell.now());
  cell.run(1);
  ASSERT_EQ(cell.core.status().state, "Door:0");
  cell.core.start(grbl_job(), cell.now());
  cell.core.hold(cell.now());
  cell.exchange();
  EXPECT_TRUE(cell.has<laser_event::Held>());
  cell.run(60);
  EXPECT_FALSE(cell.over());
  EXPECT_TRUE(cell.bench.burns.empty());
  cell.core.resume(cell.now());
  cell.exchange();
  EXPECT_TRUE(cell.has<laser_event::Resumed>());
  cell.run_job();
  EXPECT_TRUE(cell.has<laser_event::Done>());
}

// With the lid besides: opened when the hold is asked for, closed before the job goes on.
TEST(Hold, HoldsUnderAnOpenedLidToo) {
  const double length = length_of<GrblCell>(grbl_job());
  for (double at = 0.2; at < length; at += 0.05) {
    GrblCell cell;
    cell.connect_and_home();
    cell.start(grbl_job());
    cell.run(at);
    cell.bench.controller.set_lid(true, cell.now());
    cell.core.hold(cell.now());
    cell.exchange();
    cell.run(5);
    ASSERT_TRUE(cell.has<laser_event::Held>()) << at;
    ASSERT_FALSE(cell.over()) << at;
    const std::size_t burns = cell.bench.burns.size();
    cell.bench.controller.set_lid(false, cell.now());
    cell.run(30);
    ASSERT_EQ(cell.bench.burns.size(), burns) << at;
    ASSERT_FALSE(cell.over()) << at;
  }
}

}  // namespace
}  // namespace veneer
