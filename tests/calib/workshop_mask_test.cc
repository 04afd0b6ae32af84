// A sample of the campaign of the eyes (./dev soak eyes): 20 panels of every board, of grown woods so that they are the
// same everywhere, each fourth scanned with hairs on the glass.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/support/mask_figures.h"

namespace veneer {
namespace {

constexpr std::uint64_t kSeed = 2026;
constexpr int kPanels = 20;

TEST(WorkshopMask, HoldsOnASampleOfEveryBoard) {
  workshop::MaskFigures all;
  fmt::print("{}", workshop::table_head());
  for (int i = 0; i < kPanels; ++i) {
    workshop::Order order = workshop::campaign_order(kSeed, i, {});
    order.dpi = i % 2 == 0 ? 150 : 200;  // the finest take three times as long
    if (i % 4 == 3) order.hairs = 3;
    const workshop::PanelVerdict verdict = workshop::judge(workshop::compose(order));
    workshop::MaskFigures one;
    one.add(verdict);
    fmt::print("{}", table_line(verdict.board, one));
    if (!verdict.refused.empty()) fmt::print("  refused: {}\n", verdict.refused);
    all.add(one);
  }
  fmt::print("{}", table_line("all", all));
  // What must never be, and is not.
  EXPECT_EQ(all.wrong_outline, 0);
  EXPECT_EQ(all.refused, 0);
  EXPECT_EQ(all.false_hairs, 0);
  EXPECT_EQ(all.hairs_told, all.haired);
  // What must never be, and still is here and there: the mask must not get worse. docs/CALIBRATION.md tells what is
  // asked, and what the campaign finds on photographed woods. Last: 13 of 150 strips, 13 asked about, 3 false warnings,
  // none of 138 screws and holes, 1 of 43 cracks.
  // Since strips are asked about in which a band of board is seen, more are asked about (7 before) and fewer missed
  // (19).
  EXPECT_LE(all.failed, 14);
  EXPECT_LE(all.asked, 14);
  EXPECT_LE(all.failed + all.asked, 27) << "what is asked about more was taken wrongly before";
  EXPECT_LE(all.false_warnings, 3);
  EXPECT_EQ(all.round_in_mask, 0) << "a screw or a hole would be cut as wood";
  EXPECT_LE(all.cracks_in_mask, 2);
}

}  // namespace
}  // namespace veneer
