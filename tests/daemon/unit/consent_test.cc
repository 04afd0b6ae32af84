#include "daemon/unit/consent.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

std::string refusal_of(const Consent& now, std::optional<bool> lid_open) {
  LaserStatus laser;
  laser.lid_open = lid_open;
  const Status holds = check_consent({3, 7}, now, laser);
  if (holds) return "";
  EXPECT_EQ(holds.error().code, ErrorCode::kRefused);
  EXPECT_THAT(holds.error().message, HasSubstr("nothing was burnt"));
  return holds.error().message;
}

TEST(Consent, HoldsWhileNothingWasOpenedAndTheUnitWentNowhere) {
  EXPECT_EQ(refusal_of({3, 7}, false), "");
  EXPECT_EQ(refusal_of({3, 7}, std::nullopt), "") << "of a machine without a lid switch";
}

TEST(Consent, EndsWithALidThatIsOpenOrWas) {
  EXPECT_THAT(refusal_of({3, 7}, true), HasSubstr("the lid is open: close it")) << "as it was when this was asked for";
  EXPECT_THAT(refusal_of({4, 7}, true), HasSubstr("the lid was opened"));
  EXPECT_THAT(refusal_of({4, 7}, false), HasSubstr("the lid was opened")) << "and was shut again";
  EXPECT_THAT(refusal_of({4, 9}, false), HasSubstr("the lid was opened")) << "which is the graver of the two";
}

TEST(Consent, EndsWhenTheUnitGoesElsewhere) {
  EXPECT_THAT(refusal_of({3, 8}, false), HasSubstr("went on to something else"));
  EXPECT_THAT(refusal_of({3, 9}, std::nullopt), HasSubstr("went on to something else")) << "there and back again";
}

}  // namespace
}  // namespace veneer::daemon
