#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/grbl_cell.h"

namespace veneer {
namespace {

using tests::GrblCell;
using tests::square_job;

double distance_to_job(const LaserJob& job, double x, double y) {
  double least = 1e9;
  for (const Stroke& stroke : job.strokes) {
    for (std::size_t i = 1; i < stroke.path.size(); ++i) {
      const double ax = stroke.path[i - 1].x.count(), ay = stroke.path[i - 1].y.count();
      const double dx = stroke.path[i].x.count() - ax, dy = stroke.path[i].y.count() - ay;
      const double t = std::clamp(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
      least = std::min(least, std::hypot(x - ax - t * dx, y - ay - t * dy));
    }
  }
  return least;
}

TEST(GrblJob, BurnsExactlyThePlannedGeometry) {
  GrblCell cell;
  cell.connect_and_home();
  ASSERT_TRUE(cell.has<laser_event::Homed>());
  const LaserJob job = square_job(4);
  cell.start(job);
  cell.run_job();
  ASSERT_TRUE(cell.has<laser_event::Done>())
      << (cell.has<laser_event::Aborted>() ? cell.first<laser_event::Aborted>()->error.message : "not done");
  double planned = 0, burnt = 0;
  for (const Stroke& stroke : job.strokes)
    for (std::size_t i = 1; i < stroke.path.size(); ++i)
      planned += distance(stroke.path[i - 1], stroke.path[i]).count();
  for (const auto& burn : cell.bench.burns) {
    burnt += burn.length_mm();
    EXPECT_LT(distance_to_job(job, burn.from.x_mm + 520, burn.from.y_mm + 380), 0.01);
    EXPECT_LT(distance_to_job(job, burn.to.x_mm + 520, burn.to.y_mm + 380), 0.01);
  }
  EXPECT_NEAR(burnt, planned, 0.001 * planned);
}

}  // namespace
}  // namespace veneer
