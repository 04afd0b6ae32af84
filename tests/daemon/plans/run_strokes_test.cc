// What laser run's lists become: strokes of no piece, long ones in parts.
#include "daemon/plans/run_strokes.h"

#include <gmock/gmock.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

DrawnStrokes two_lines() {
  DrawnStrokes drawn;
  drawn.points_mm = {10, 10, 20, 10, 0, 0, 5, 0, 5, 5};
  drawn.points_per_stroke = {2, 3};
  drawn.speeds_mm_s = {20};
  drawn.powers = {0.5, 0.2};
  return drawn;
}
std::string refusal(const DrawnStrokes& drawn) {
  const auto job = job_of_strokes(drawn, false);
  return job.ok() ? "taken" : job.error().message;
}

TEST(RunStrokes, TakesOneNumberForAllOrOneForEach) {
  DrawnStrokes drawn = two_lines();
  drawn.passes = {1, 3};
  drawn.air = {1};
  const auto job = job_of_strokes(drawn, false);
  ASSERT_TRUE(job.ok()) << job.error().message;
  ASSERT_EQ(job->strokes.size(), 2U);
  EXPECT_EQ(job->strokes[0].power.count(), 0.5);
  EXPECT_EQ(job->strokes[1].power.count(), 0.2);
  EXPECT_EQ(job->strokes[1].speed.count(), 20);
  EXPECT_EQ(job->strokes[1].passes, 3);
  EXPECT_TRUE(job->strokes[1].air);
  EXPECT_EQ(job->strokes[1].path.size(), 3U);
  EXPECT_EQ(job->strokes[1].path.back(), point<MachineFrame>(5, 5));
  EXPECT_EQ(job->strokes[0].piece, PieceId{});
  EXPECT_NEAR(length_of(*job).count(), 10 + 3 * 10, 1e-9);
}

TEST(RunStrokes, HasNoPowerAnywhereWhenDry) {
  const auto job = job_of_strokes(two_lines(), true);
  ASSERT_TRUE(job.ok());
  for (const Stroke& stroke : job->strokes) EXPECT_EQ(stroke.power.count(), 0);
}

TEST(RunStrokes, CutsLongLinesIntoPartsThatMeet) {
  DrawnStrokes drawn;
  for (int i = 0; i < 2500; ++i) drawn.points_mm.insert(drawn.points_mm.end(), {i * 0.1, static_cast<double>(i % 2)});
  drawn.points_per_stroke = {2500};
  drawn.speeds_mm_s = {50};
  drawn.powers = {1};
  const auto job = job_of_strokes(drawn, false);
  ASSERT_TRUE(job.ok());
  ASSERT_EQ(job->strokes.size(), 3U);
  std::size_t segments = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    segments += job->strokes[i].path.size() - 1;
    EXPECT_LE(job->strokes[i].path.size(), 1000U);
    if (i > 0) {
      EXPECT_EQ(job->strokes[i].path.front(), job->strokes[i - 1].path.back());
    }
  }
  EXPECT_EQ(segments, 2499U);
}

TEST(RunStrokes, RefusesListsThatDoNotFitEachOther) {
  EXPECT_EQ(refusal(two_lines()), "taken");
  DrawnStrokes drawn = two_lines();
  drawn.points_mm.pop_back();
  EXPECT_THAT(refusal(drawn), HasSubstr("points_mm has 9 numbers"));
  drawn = two_lines();
  drawn.points_per_stroke = {4, 1};
  EXPECT_THAT(refusal(drawn), HasSubstr("at least 2"));
  drawn = two_lines();
  drawn.points_per_stroke = {2.5, 2.5};
  EXPECT_THAT(refusal(drawn), HasSubstr("whole"));
  drawn = two_lines();
  drawn.powers = {0.1, 0.2, 0.3};
  EXPECT_THAT(refusal(drawn), HasSubstr("powers must have one number"));
  drawn = two_lines();
  drawn.passes = {1.5};
  EXPECT_THAT(refusal(drawn), HasSubstr("passes must be whole"));
  drawn = two_lines();
  drawn.points_per_stroke = {1e6};
  EXPECT_THAT(refusal(drawn), HasSubstr("split the drawing"));
}

TEST(RunStrokes, FitsTheTravelAndEndsAtTheCornerWhereNoSwitchTellsIt) {
  LaserLimits limits{{}, "Grbl 1.1h", false};
  limits.travel.add(point<MachineFrame>(0, 0));
  limits.travel.add(point<MachineFrame>(300, 200));
  auto job = job_of_strokes(two_lines(), false);
  ASSERT_TRUE(job.ok());
  EXPECT_TRUE(check_fits(*job, limits));
  limits.travel.max.x = Millimetres(15);
  EXPECT_THAT(check_fits(*job, limits).error().message, HasSubstr("--x-mm"));
  return_to_corner(*job, limits, MmPerSecond(80));
  ASSERT_EQ(job->strokes.size(), 3U);
  EXPECT_EQ(job->strokes.back().path.back(), point<MachineFrame>(0, 0));
  EXPECT_EQ(job->strokes.back().power.count(), 0);
  limits.finds_home = true;
  return_to_corner(*job, limits, MmPerSecond(80));
  EXPECT_EQ(job->strokes.size(), 3U);
}

}  // namespace
}  // namespace veneer::daemon
