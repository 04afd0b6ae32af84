#include "daemon/calibration/test_pattern.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

LaserLimits limits(bool finds_home = true) {
  LaserLimits l{{}, "Grbl 1.1h", finds_home};
  l.travel.add(point<MachineFrame>(0, 0));
  l.travel.add(point<MachineFrame>(519, 379));
  return l;
}

Box<MachineFrame> extent(const LaserJob& job) {
  Box<MachineFrame> box;
  for (const Stroke& stroke : job.strokes)
    for (const auto& p : stroke.path) box.add(p);
  return box;
}

TEST(TestPattern, FillsItsSquareInTheMiddleOfTheBed) {
  const auto job = make_test_pattern(limits(), {}, {});
  ASSERT_TRUE(job.ok());
  const auto box = extent(*job);
  EXPECT_NEAR(box.min.x.count(), 519 / 2.0 - 25, 1e-9);
  EXPECT_NEAR(box.max.y.count(), 379 / 2.0 + 25, 1e-9);
  EXPECT_NEAR(box.width().count(), 50, 1e-9);
  for (const Stroke& stroke : job->strokes) EXPECT_GT(stroke.power.count(), 0);
  EXPECT_DOUBLE_EQ(job->strokes.back().power.count(), RecipeConfig{}.cut_power.count());
}

TEST(TestPattern, BeginsAtTheHeadWhereNoSwitchTellsTheCorner) {
  const auto job = make_test_pattern(limits(false), {}, {.size = Millimetres(30)});
  ASSERT_TRUE(job.ok());
  EXPECT_NEAR(extent(*job).min.x.count(), 0, 1e-9);
  EXPECT_NEAR(extent(*job).max.y.count(), 30, 1e-9);
}

TEST(TestPattern, EndsWhereItBeganWhereNoSwitchTellsTheCorner) {
  const auto job =
      make_test_pattern(limits(false), {}, {.size = Millimetres(30), .corner = point<MachineFrame>(40, 50)});
  ASSERT_TRUE(job.ok());
  EXPECT_EQ(job->strokes.back().path.back(), point<MachineFrame>(0, 0));
  EXPECT_EQ(job->strokes.back().power.count(), 0);
}

TEST(TestPattern, HasNoPowerAnywhereWhenDark) {
  const auto job = make_test_pattern(limits(), {}, {.dark = true});
  ASSERT_TRUE(job.ok());
  for (const Stroke& stroke : job->strokes) EXPECT_EQ(stroke.power.count(), 0);
}

TEST(TestPattern, SaysWhereItWouldLeaveTheTravel) {
  const auto placed = make_test_pattern(limits(), {}, {.corner = point<MachineFrame>(500, 10)});
  ASSERT_FALSE(placed.ok());
  EXPECT_THAT(placed.error().message, HasSubstr("x 0.0 to 519.0 mm"));
  EXPECT_FALSE(make_test_pattern(limits(), {}, {.size = Millimetres(400)}).ok());
  EXPECT_FALSE(make_test_pattern(limits(), {}, {.size = Millimetres(1)}).ok());
}

}  // namespace
}  // namespace veneer::daemon
