// After calibration in a workshop the bed is known to a tenth of a millimetre, whatever board the axes were burnt into:
// one that is bowed and of another thickness than the last.
#include <gtest/gtest.h>

#include "tests/support/played_sight.h"

namespace veneer::tests {
namespace {

TEST(WorkshopSight, FindsPanelsWhereTheyLieAndCutsThere) {
  const auto rough = sim::roughness_preset("workshop");
  ASSERT_TRUE(rough);
  // Of the first 300 seeds the two whose boards stand highest, and the one whose ends do.
  for (const std::uint64_t seed : {169, 252, 262}) {
    const auto figures = play_sight(seed, *rough, {});
    ASSERT_TRUE(figures.ok()) << "seed " << seed << ": " << figures.error().message;
    EXPECT_LE(figures->pose_rms_mm, 0.10) << "seed " << seed;
    EXPECT_LE(figures->cut_rms_mm, 0.05) << "seed " << seed;
  }
}

}  // namespace
}  // namespace veneer::tests
