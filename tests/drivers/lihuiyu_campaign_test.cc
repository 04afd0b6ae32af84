// A seeded sample of the Lihuiyu driver's fault campaign: fifty runs of each kind. `./dev soak faults` runs five
// hundred.
#include <gmock/gmock.h>

#include <cctype>
#include <string>

#include "tests/support/lihuiyu_campaign.h"
#include "tests/support/lihuiyu_job.h"

namespace veneer::tests {
namespace {

class LihuiyuCampaign : public ::testing::TestWithParam<std::string_view> {};

TEST_P(LihuiyuCampaign, NeverReportsAWrongPieceAndNeverMovesUnasked) {
  const BoardRow row = run_board_campaign(GetParam(), 50, 20260501);
  EXPECT_EQ(row.complete + row.aborted, 50);
  EXPECT_TRUE(row.clean()) << ::testing::PrintToString(row.complaints);
  EXPECT_LE(row.longest_queue_s, 1.0);
  EXPECT_LE(row.hausdorff_mm, kBurnTolerance);
}

INSTANTIATE_TEST_SUITE_P(Faults, LihuiyuCampaign, ::testing::ValuesIn(kBoardFaults),
                         [](const auto& test) { return std::string(test.param); });

TEST(LihuiyuCampaignItself, SeesAProgramThatLostAPacket) {
  // The judge is judged: a piece whose burns lack a stretch, or that was burnt twice, is called wrong.
  const LaserJob job = odd_job(1);
  std::vector<sim::BurnSegment> burns;
  for (const MmLeg& leg : planned_legs(job, PieceId{1})) {
    sim::BurnSegment burn;
    burn.from = {leg.ax - kLihuiyuTravelX, leg.ay - kLihuiyuTravelY};
    burn.to = {leg.bx - kLihuiyuTravelX, leg.by - kLihuiyuTravelY};
    burns.push_back(burn);
  }
  EXPECT_EQ(wrong_piece(job, PieceId{1}, burns), "");
  std::vector<sim::BurnSegment> twice = burns;
  twice.insert(twice.end(), burns.begin() + 1, burns.end());
  EXPECT_NE(wrong_piece(job, PieceId{1}, twice), "");
  burns[1].to.x_mm -= 0.1;
  EXPECT_NE(wrong_piece(job, PieceId{1}, burns), "");
}

}  // namespace
}  // namespace veneer::tests
