#include "base/clock.h"

#include <gmock/gmock.h>

namespace veneer {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(ManualClock, StandsStillUntilTold) {
  ManualClock clock;
  const auto start = clock.now();
  EXPECT_EQ(clock.now(), start);
  clock.advance(milliseconds(1500));
  EXPECT_EQ(clock.now() - start, milliseconds(1500));
  EXPECT_EQ(clock.real_delay(seconds(5)), Duration(0));
}

TEST(SteadyClock, NeverRunsBackwards) {
  const SteadyClock clock;
  const auto first = clock.now();
  EXPECT_GE(clock.now(), first);
  EXPECT_EQ(clock.real_delay(seconds(2)), seconds(2));
}

TEST(ScaledClock, RunsAsManyTimesAsFast) {
  const ScaledClock clock(10);
  EXPECT_EQ(clock.real_delay(seconds(10)), seconds(1));
  EXPECT_EQ(clock.scale(), 10);
}

TEST(ScaledClock, TwoOfTheSameScaleAgree) {
  const ScaledClock first(20), second(20);
  const auto before = first.now();
  const auto between = second.now();
  EXPECT_GE(between, before);
  EXPECT_GE(first.now(), between);
}

TEST(ScaledClock, AnUnusableScaleIsRealTime) {
  for (const double scale : {0.0, -3.0, std::numeric_limits<double>::infinity()})
    EXPECT_EQ(ScaledClock(scale).scale(), 1) << scale;
}

TEST(UtcTimestamp, IsIso8601WithMilliseconds) {
  const std::string now = utc_timestamp();
  EXPECT_THAT(now, ::testing::MatchesRegex("20[0-9][0-9]-[01][0-9]-[0-3][0-9]T[0-2][0-9]:[0-5][0-9]:[0-6][0-9]\\."
                                           "[0-9][0-9][0-9]Z"));
  EXPECT_LE(now, utc_timestamp()) << "timestamps compare as text";
}

}  // namespace
}  // namespace veneer
