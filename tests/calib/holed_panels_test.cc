// A sample of the campaign of screw holes (./dev soak eyes): panels of the twin of which holes in dark wood were taken
// for wood once, and the first few of a seed.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/support/holed_panels.h"

namespace veneer {
namespace {

TEST(HoledPanels, NoScrewHoleIsTakenForWood) {
  const workshop::HoledPanelOrder orders[] = {{1, 0, "bench"},    {1, 1, "workshop"}, {1, 2, "bench"},
                                              {1, 3, "workshop"}, {5, 10, "bench"},   {5, 50, "bench"},
                                              {5, 54, "bench"},   {217, 0, "bench"}};
  workshop::HoleFigures all;
  for (const auto& order : orders) {
    const workshop::HoledPanelVerdict verdict = workshop::judge_holes(order);
    EXPECT_EQ(verdict.refused, "") << order.seed << " " << order.panel;
    for (const auto& hole : verdict.taken)
      ADD_FAILURE() << fmt::format("seed {}, panel {}: {:.2f} of a hole of {:.1f} mm in {} at {:.0f}, {:.0f}",
                                   order.seed, order.panel, hole.taken, hole.diameter, hole.species, hole.x, hole.y);
    all.add(verdict);
  }
  fmt::print("{}{}", workshop::hole_table_head(), workshop::hole_table_line("sample", all));
  EXPECT_GT(all.holes, 50);
  EXPECT_EQ(all.beside, 0);
  // A mask that takes nothing takes no hole either. Of a strip that is asked about it takes nothing.
  EXPECT_GT(all.wood_taken, 0.95 * all.wood);
  EXPECT_LE(all.asked, 1);
}

TEST(HoledPanels, RefuseAPresetThatIsNotThere) {
  EXPECT_EQ(workshop::judge_holes({1, 0, "benhc"}).refused,
            "there is no preset called 'benhc': bench, workshop or rough");
}

}  // namespace
}  // namespace veneer
