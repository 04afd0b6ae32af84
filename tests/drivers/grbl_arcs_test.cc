// Curves as arcs: what the controller burns of them, how long they take, and what happens when one is changed on the
// wire.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "drivers/grbl/arc_guard.h"
#include "tests/support/grbl_cell.h"

namespace veneer::tests {
namespace {

using ::testing::HasSubstr;

Stroke curve(PieceId piece, const Polyline<MachineFrame>& path, double speed = 15) {
  return {piece, StrokeRole::kCut, path, MmPerSecond(speed), PowerFraction(0.8), 1};
}

Polyline<MachineFrame> arc(double x, double y, double radius, double from, double turn, int lines) {
  Polyline<MachineFrame> path;
  for (int i = 0; i <= lines; ++i)
    path.push_back(point<MachineFrame>(x + radius * std::cos(from + turn * i / lines),
                                       y + radius * std::sin(from + turn * i / lines)));
  return path;
}

// A drop: a straight flank, a round belly, a flank back.
Polyline<MachineFrame> drop(double x, double y, double radius) {
  auto path = arc(x, y, radius, -0.3, kPi + 0.6, 480);
  path.push_back(point<MachineFrame>(x, y - 3 * radius));
  path.push_back(path.front());
  return path;
}

grbl::MachineSettings stock_machine() {
  const sim::GrblSettings stock = sim::GrblSettings::laser_cutter();
  grbl::MachineSettings machine;
  machine.x.travel_mm = stock[130], machine.y.travel_mm = stock[131];
  for (grbl::Axis* axis : {&machine.x, &machine.y}) {
    axis->steps_per_mm = stock[100];
    axis->max_rate_mm_s = stock[110] / 60;
    axis->acceleration_mm_s2 = stock[120];
    axis->origin_mm = -axis->travel_mm;
  }
  machine.junction_deviation_mm = stock[11];
  machine.arc_tolerance_mm = stock[12];
  return machine;
}

double distance_to(const Polyline<MachineFrame>& path, double x, double y) {
  double nearest = 1e9;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double ax = path[i - 1].x.count(), ay = path[i - 1].y.count();
    const double ux = path[i].x.count() - ax, uy = path[i].y.count() - ay, squared = ux * ux + uy * uy;
    const double t = squared > 0 ? std::clamp(((x - ax) * ux + (y - ay) * uy) / squared, 0.0, 1.0) : 0;
    nearest = std::min(nearest, std::hypot(x - ax - t * ux, y - ay - t * uy));
  }
  return nearest;
}

TEST(GrblArcs, BurnsWhatTheLinesWouldHaveBurntWithFewerOfThem) {
  const auto path = drop(200, 150, 8);
  GrblCell cell;
  cell.connect_and_home();
  cell.bench.burns.clear();
  cell.start({{curve(PieceId{1}, path)}});
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  EXPECT_THAT(cell.sent, HasSubstr("G3X"));
  double farthest = 0, burnt = 0, planned = 0;
  for (const auto& burn : cell.bench.burns) {
    burnt += burn.length_mm();
    for (const auto& p : {burn.from, burn.to})
      farthest = std::max(farthest, distance_to(path, p.x_mm + 520, p.y_mm + 380));
  }
  for (std::size_t i = 1; i < path.size(); ++i) planned += distance(path[i - 1], path[i]).count();
  EXPECT_LE(farthest, 0.02);  // 0.01 of the fit, and the machine's steps of 0.0125
  EXPECT_NEAR(burnt, planned, 0.05);
  std::size_t lines = 0;
  for (const auto& line :
       grbl::write_group(std::vector{curve(PieceId{1}, path)}, 0, {-300000, -200000}, stock_machine(), 0.2))
    lines += line.kind == grbl::LineKind::kBurn ? 1 : 0;
  EXPECT_LT(lines, path.size() / 2);
  EXPECT_LE(cell.longest_queue_s, 1.0);
}

TEST(GrblArcs, AreNeverUnderWayLongerThanTheQueueCounts) {
  for (const double radius : {0.3, 0.8, 2.0, 6.0, 15.0}) {
    for (const double speed : {5.0, 30.0, 80.0, 300.0}) {
      GrblCell cell;
      cell.connect_and_home();
      const auto path = arc(200, 150, radius, 0.2, 2.5, 600);
      cell.start({{curve(PieceId{1}, path, speed)}});
      cell.run_job();
      ASSERT_TRUE(cell.has<laser_event::Done>()) << radius << " mm at " << speed;
      EXPECT_LE(cell.longest_queue_s, 1.0);
      EXPECT_LE(cell.bench.controller.beam_log().longest_queued_motion_s, 1.0);
      double first = 1e18, last = 0;
      for (const auto& burn : cell.bench.burns) {
        first = std::min(first, std::chrono::duration<double>(burn.start.time_since_epoch()).count());
        last = std::max(last, std::chrono::duration<double>(burn.end.time_since_epoch()).count());
      }
      const grbl::WirePoint at = stock_machine().to_wire(path.front());
      double counted = 0;
      for (const auto& line :
           grbl::write_group(std::vector{curve(PieceId{1}, path, speed)}, 0, at, stock_machine(), 0.2))
        counted += line.kind == grbl::LineKind::kBurn ? line.longest_s : 0;
      EXPECT_LE(last - first, counted + 1e-3) << radius << " mm at " << speed;
    }
  }
}

TEST(GrblArcs, AreNotSentWhereALostPointWouldMakeAStraightLineOfThem) {
  // I-607 J.512 ends at the same place as I-.607 J.512, by a line 0.05 mm beside the arc.
  EXPECT_FALSE(grbl::arc_is_safe({0, 0}, {187, 514}, {{-607, 512}, false}));
  EXPECT_TRUE(grbl::arc_is_safe({0, 0}, {700, 12}, {{0, 20000}, false}));
}

TEST(GrblArcs, GivesUpThePieceWhenAnArcArrivesTheOtherWayRound) {
  // Both ways end at the same place: only the mode asked back tells.
  GrblCell cell;
  cell.connect_and_home();
  cell.on_wire = [](std::string& bytes) {
    if (const auto at = bytes.find("G3X"); at != std::string::npos) bytes[at + 1] = '2';
  };
  cell.start({{curve(PieceId{4}, drop(200, 150, 8))}});
  cell.run_job();
  const auto aborted = cell.first<laser_event::Aborted>();
  ASSERT_TRUE(aborted);
  EXPECT_EQ(aborted->suspect, std::vector{PieceId{4}});
  EXPECT_FALSE(cell.has<laser_event::PieceVerified>());
}

TEST(GrblArcs, NoticesADigitOfTheCentreThatWasLost) {
  GrblCell cell;
  cell.connect_and_home();
  bool changed = false;
  cell.on_wire = [&](std::string& bytes) {
    const auto at = bytes.find('I');
    if (at == std::string::npos || changed) return;
    changed = true;
    bytes.erase(bytes.find_first_of("123456789", at), 1);
  };
  cell.start({{curve(PieceId{4}, drop(200, 150, 8))}});
  cell.run_job();
  ASSERT_TRUE(changed);
  EXPECT_TRUE(cell.has<laser_event::Aborted>());
}

TEST(GrblArcs, FillsRunUpAndOutInTheDark) {
  GrblCell cell;
  cell.connect_and_home();
  cell.bench.burns.clear();
  Stroke line = curve(PieceId{1}, {point<MachineFrame>(100, 100), point<MachineFrame>(120, 100)}, 80);
  line.overscan = Millimetres(4);
  cell.start({{line}});
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>());
  double burnt = 0;
  for (const auto& burn : cell.bench.burns) {
    burnt += burn.length_mm();
    EXPECT_GE(burn.from.x_mm + 520, 99.99);
    EXPECT_LE(burn.to.x_mm + 520, 120.01);
    // At full speed from end to end.
    EXPECT_NEAR(burn.length_mm() / std::chrono::duration<double>(burn.end - burn.start).count(), 80, 0.5);
  }
  EXPECT_NEAR(burnt, 20, 0.03);
  // The run-out must lie on the machine too.
  line.path = {point<MachineFrame>(100, 100), point<MachineFrame>(517, 100)};
  EXPECT_FALSE(grbl::check_job({{line}}, stock_machine()).ok());
}

}  // namespace
}  // namespace veneer::tests
