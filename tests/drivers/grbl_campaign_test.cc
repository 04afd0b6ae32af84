// A seeded sample of the fault campaign: fifty runs of each kind. `./dev soak faults` runs five hundred.
#include <gmock/gmock.h>

#include <cctype>
#include <string>

#include "tests/support/fault_campaign.h"

namespace veneer::tests {
namespace {

class GrblCampaign : public ::testing::TestWithParam<std::size_t> {};

TEST_P(GrblCampaign, NeverReportsAWrongPieceAndNeverMovesUnasked) {
  const FaultRow row = run_campaign(static_cast<WireFault>(GetParam()), 50, 20260501);
  EXPECT_EQ(row.complete + row.held + row.aborted, 50);
  EXPECT_TRUE(row.clean()) << ::testing::PrintToString(row.complaints);
  if (!changes_lines(row.kind)) {
    EXPECT_LE(row.longest_queue_s, 1.0);
    EXPECT_EQ(row.wrong_energy, 0) << ::testing::PrintToString(row.complaints);
  }
  EXPECT_LE(row.hausdorff_mm, 0.02 + 0.0089);
  EXPECT_EQ(row.unaccused, 0) << ::testing::PrintToString(row.notes);
}

INSTANTIATE_TEST_SUITE_P(Faults, GrblCampaign, ::testing::Range<std::size_t>(0, kWireFaults), [](const auto& test) {
  std::string name;
  for (const char c : name_of(static_cast<WireFault>(test.param)))
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  return name;
});

}  // namespace
}  // namespace veneer::tests
