// A seeded sample of the campaign of Holds: twenty-five of each kind. `./dev soak holds` presses a thousand.
#include <gtest/gtest.h>

#include "tests/support/hold_campaign.h"

namespace veneer::tests {
namespace {

class Holds : public ::testing::TestWithParam<std::string_view> {};

TEST_P(Holds, BeginNoPieceOnceTheyAreAnnounced) {
  const HoldRow row = run_hold_campaign(GetParam(), 25, 20261122);
  EXPECT_TRUE(row.clean()) << ::testing::PrintToString(row.complaints);
  EXPECT_EQ(row.looks_past_head, 0) << "the head leaves the picture between two pieces, after an opened lid too";
  EXPECT_GT(row.held, 10) << "hardly any was taken: this proves nothing";
  if (GetParam().ends_with("lid")) {
    EXPECT_GT(row.nudged, 5);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Holds, ::testing::ValuesIn(kHoldKinds), [](const auto& test) {
  std::string name;
  for (const char c : test.param)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  return name;
});

}  // namespace
}  // namespace veneer::tests
