// The estimate against the simulated machine's own clock, through the real driver.
#include "planner/cutting/time_estimate.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>

#include "planner/cutting/toolpath.h"
#include "tests/planner/cutting/scattered_pieces.h"
#include "tests/support/grbl_cell.h"
#include "tests/support/toolpath_piece.h"

namespace veneer::planner {
namespace {

using test::toolpath_piece;

Kinematics kinematics_of(const sim::GrblSettings& machine) {
  Kinematics k;
  k.rapid_x = MmPerSecond(machine[110] / 60), k.rapid_y = MmPerSecond(machine[111] / 60);
  k.acceleration_x = MmPerSecond2(machine[120]), k.acceleration_y = MmPerSecond2(machine[121]);
  k.junction_deviation = Millimetres(machine[11]);
  return k;
}

struct Times {
  double estimated = 0, simulated = 0;
};

Times times_of(const std::string& name, const std::vector<ToolpathPiece>& pieces, ToolpathOptions options,
               const sim::GrblSettings& machine = sim::GrblSettings::laser_cutter()) {
  tests::GrblCell cell(machine);
  cell.connect_and_home();
  options.kinematics = kinematics_of(machine);
  options.start = point<BedFrame>(machine[130] - machine[27], machine[131] - machine[27]);
  const auto path = make_toolpath(pieces, options);
  EXPECT_TRUE(path.ok());
  LaserJob job;
  for (const auto& stroke : path->strokes) {
    Stroke& s = job.strokes.emplace_back();
    s.piece = stroke.piece;
    s.role = stroke.role;
    for (const auto& p : stroke.path) s.path.push_back({p.x, p.y});
    s.speed = stroke.speed, s.power = stroke.power, s.passes = stroke.passes;
  }
  const TimePoint begin = cell.now();
  cell.start(std::move(job));
  cell.run(36000, [&] { return cell.over(); });
  EXPECT_TRUE(cell.has<laser_event::Done>()) << name;
  const Times times{path->estimate.count(), std::chrono::duration<double>(cell.now() - begin).count()};
  std::printf("%s: estimated %.1f s, simulated %.1f s, %+.2f %%\n", name.c_str(), times.estimated, times.simulated,
              100 * (times.estimated / times.simulated - 1));
  return times;
}

void expect_close(const Times& times) { EXPECT_NEAR(times.estimated / times.simulated, 1, 0.05); }

// An outline that waves around a circle.
Ring<BedFrame> wave(double x, double y, double radius, int waves, double depth) {
  Ring<BedFrame> ring;
  const int n = 720;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * kPi * i / n, r = radius + depth * std::sin(waves * a);
    ring.push_back(point<BedFrame>(x + r * std::cos(a), y + r * std::sin(a)));
  }
  return ring;
}

TEST(TimeEstimate, IsWithinFivePercentOnThreeHundredSmallPieces) {
  expect_close(times_of("300 small pieces", test::scattered_pieces(300, 14, true), {}));
}

TEST(TimeEstimate, IsWithinFivePercentOnDenseEngraving) {
  // Marks as long as they come, over a faint outline that is gone over fast.
  std::vector<ToolpathPiece> pieces;
  for (int i = 0; i < 24; ++i) {
    const int column = i % 6, row = i / 6;
    const double x = 30 + 75 * column, y = 40 + 40 * row;
    pieces.push_back(toolpath_piece(
        i + 1,
        {point<BedFrame>(x, y), point<BedFrame>(x + 70, y), point<BedFrame>(x + 70, y + 8), point<BedFrame>(x, y + 8)},
        "SB8G0-3CQ9R-S6B-2853-8GB90-S8B3G"));
  }
  ToolpathOptions options;
  options.recipe.cut_speed = MmPerSecond(200);
  options.recipe.engrave_passes = 2;
  expect_close(times_of("dense engraving", pieces, options));
}

TEST(TimeEstimate, IsWithinFivePercentOnLongCurves) {
  std::vector<ToolpathPiece> pieces;
  for (int i = 0; i < 6; ++i) {
    const int column = i % 3, row = i / 3;
    pieces.push_back(toolpath_piece(i + 1, wave(90 + 160 * column, 100 + 170 * row, 60, 9 + i, 6), ""));
  }
  ToolpathOptions options;
  options.recipe.cut_speed = MmPerSecond(40);
  expect_close(times_of("long curves", pieces, options));
}

TEST(TimeEstimate, FollowsTheMachinesOwnSettings) {
  auto slow = sim::GrblSettings::laser_cutter();
  slow.values[110] = 9000, slow.values[111] = 6000, slow.values[120] = 300, slow.values[121] = 500;
  slow.values[11] = 0.002;
  expect_close(times_of("small pieces on a slow machine", test::scattered_pieces(40, 12, true), {}, slow));
}

}  // namespace
}  // namespace veneer::planner
