#include "tests/bench/goals.h"

#include <gmock/gmock.h>

#include <limits>
#include <sstream>

namespace veneer::bench {
namespace {

using ::testing::HasSubstr;

class JudgeTest : public ::testing::Test {
 protected:
  JudgeTest() { shown_.SetOutputStream(&out_), shown_.SetErrorStream(&out_); }
  void measure(double bytes) {
    Judge::Run run;
    run.run_type = Judge::Run::RT_Iteration;
    run.run_name.function_name = "BM_a", run.run_name.args = "4";
    run.counters["bytes"] = bytes;
    judge_.ReportRuns({run});
  }

  const std::vector<Goal> goals_ = {{"BM_a/4", "bytes", 100, "bytes"}};
  std::ostringstream out_;
  benchmark::JSONReporter shown_;
  Judge judge_{shown_, goals_};
};

TEST_F(JudgeTest, AFigureKeepsWithinItsGoal) {
  measure(100);
  judge_.expect_all();
  EXPECT_FALSE(judge_.any_missed()) << judge_.told();
  EXPECT_THAT(judge_.told(), HasSubstr("kept"));
}

TEST_F(JudgeTest, OrMissesIt) {
  measure(100.5);
  EXPECT_TRUE(judge_.any_missed());
  EXPECT_THAT(judge_.told(), HasSubstr("MISSED"));
}

TEST_F(JudgeTest, WhatIsNoNumberMissesIt) {
  measure(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(judge_.any_missed());
}

TEST_F(JudgeTest, WhatNoBenchmarkMeasuredIsMissedWhereAllWereToRun) {
  EXPECT_FALSE(judge_.any_missed());
  EXPECT_EQ(judge_.told(), "");
  judge_.expect_all();
  EXPECT_TRUE(judge_.any_missed());
  EXPECT_THAT(judge_.told(), HasSubstr("not measured"));
}

TEST_F(JudgeTest, NorOfThoseThatWereNotToRun) {
  judge_.expect_all("BM_b");
  EXPECT_FALSE(judge_.any_missed()) << judge_.told();
  judge_.expect_all("BM_a");
  EXPECT_TRUE(judge_.any_missed());
}

}  // namespace
}  // namespace veneer::bench
