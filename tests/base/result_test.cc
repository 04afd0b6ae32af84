#include "base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace veneer {
namespace {

Result<std::unique_ptr<int>> made(bool well) {
  if (well) return std::make_unique<int>(7);
  return Error{ErrorCode::kRefused, "the residual is 0.3 mm: scan again"};
}

TEST(Result, HoldsAValueOrAnError) {
  const auto good = made(true);
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(**good, 7);
  const auto bad = made(false);
  ASSERT_FALSE(bad.ok());
  EXPECT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kRefused);
  EXPECT_EQ(bad.error().message, "the residual is 0.3 mm: scan again");
}

TEST(Result, GivesItsValueAway) {
  const std::unique_ptr<int> taken = made(true).value();
  EXPECT_EQ(*taken, 7);
}

TEST(ResultDeathTest, AskingForWhatIsNotThereAborts) {
  EXPECT_DEATH({ [[maybe_unused]] const auto& value = made(false).value(); }, "");
  EXPECT_DEATH({ [[maybe_unused]] const auto& error = made(true).error(); }, "");
  EXPECT_DEATH({ [[maybe_unused]] const auto& error = Ok().error(); }, "");
}

TEST(Status, IsOkUntilItHoldsAnError) {
  EXPECT_TRUE(Ok().ok());
  const Status status = Error{ErrorCode::kTimeout, "the scanner did not answer: check its cable"};
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kTimeout);
}

TEST(ErrorCode, HasADistinctNameEach) {
  EXPECT_STREQ(to_string(ErrorCode::kInvalidArgument), "invalid_argument");
  EXPECT_STREQ(to_string(ErrorCode::kDeviceFault), "device_fault");
  EXPECT_STREQ(to_string(ErrorCode::kInternal), "internal");
}

}  // namespace
}  // namespace veneer
