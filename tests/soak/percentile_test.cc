#include "tests/soak/percentile.h"

#include <gtest/gtest.h>

#include <numeric>

namespace veneer::tests {
namespace {

TEST(PercentileTest, IsTheLeastThatIsAsLargeAsTheShare) {
  std::vector<double> hundred(100);
  std::iota(hundred.rbegin(), hundred.rend(), 1);
  EXPECT_EQ(percentile(hundred, 0.5), 50);
  EXPECT_EQ(percentile(hundred, 0.99), 99);
  EXPECT_EQ(percentile(hundred, 1), 100);
  EXPECT_EQ(percentile(hundred, 0), 1);
}

TEST(PercentileTest, OfFewIsOneOfThem) {
  EXPECT_EQ(percentile({}, 0.99), 0);
  EXPECT_EQ(percentile({7}, 0.5), 7);
  EXPECT_EQ(percentile({3, 1, 2}, 0.99), 3);
  EXPECT_EQ(percentile({3, 1, 2}, 0.5), 2);
}

// 0.07 * 100 is a little more than 7 as a double.
TEST(PercentileTest, IsNotOneFurtherForARoundingError) {
  std::vector<double> hundred(100);
  std::iota(hundred.begin(), hundred.end(), 1);
  EXPECT_EQ(percentile(hundred, 0.07), 7);
}

}  // namespace
}  // namespace veneer::tests
