// After calibration in a workshop the bed is known to a tenth of a millimetre, whatever board the axes were burnt into:
// one that is bowed and of another thickness than the last.
#include <gtest/gtest.h>

#include "tests/support/played_sight.h"

namespace veneer::tests {
namespace {

TEST(WorkshopSight, FindsPanelsWhereTheyLieAndCutsThere) {
  const auto rough = sim::roughness_preset("workshop");
  ASSERT_TRUE(rough);
  for (std::uint64_t seed = 2101; seed < 2107; ++seed) {
    const auto figures = play_sight(seed, *rough, {});
    ASSERT_TRUE(figures.ok()) << "seed " << seed << ": " << figures.error().message;
    EXPECT_LE(figures->pose_rms_mm, 0.10) << "seed " << seed;
    EXPECT_LE(figures->cut_rms_mm, 0.05) << "seed " << seed;
  }
}

}  // namespace
}  // namespace veneer::tests
