#include "planner/suggest/fitting_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <optional>
#include <vector>

#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"
#include "tests/support/temp_directory.h"

namespace veneer::planner {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

PlanOptions of_patch(Millimetres patch) {
  PlanOptions out = test::small_options_without_saliency();
  out.patch = patch, out.rotations = 1;
  return out;
}

// All of it free, 2 px/mm.
StockPanel free_panel(int columns, int rows) {
  StockPanel panel = test::wood_panel("P", columns, rows, 50.8, 2);
  panel.free.pixels.setTo(255);
  return panel;
}

class FittingSizes : public ::testing::Test {
 protected:
  std::vector<FittingSize> found(const Artwork& artwork, const StockPanel& panel, const PlanOptions& options) {
    const auto out = fitting_sizes(artwork, {&panel, 1}, options, limits, clock);
    EXPECT_TRUE(out.ok()) << out.error().message;
    EXPECT_TRUE(!out.ok() || out->tried > 0);
    return out.ok() ? out->sizes : std::vector<FittingSize>();
  }
  // Every time it is looked at, a second has passed.
  class Running final : public Clock {
   public:
    TimePoint now() const override { return TimePoint(std::chrono::seconds(++looks_)); }
    Duration real_delay(Duration device) const override { return device; }

   private:
    mutable std::atomic<int> looks_{0};
  };
  FittingLimits limits;
  ManualClock clock;  // no time passes
};

TEST_F(FittingSizes, AreThoseAtWhichEachPatchHasWood) {
  const StockPanel panel = free_panel(100, 100);
  const Artwork artwork = test::blob_artwork("A", 90, 60, 60_mm, 1);
  const PlanOptions options = of_patch(12_mm);
  const auto sizes = found(artwork, panel, options);
  ASSERT_FALSE(sizes.empty());
  EXPECT_EQ(sizes.front().patch, 12_mm);
  for (const FittingSize& one : sizes) {
    EXPECT_LE(one.size, 60_mm);
    Artwork smaller = artwork;
    smaller.width = artwork.width * (one.size / 60_mm), smaller.height = artwork.height * (one.size / 60_mm);
    PlanOptions as_found = options;
    as_found.patch = one.patch;
    EXPECT_FALSE(test::planned({smaller}, {panel}, as_found).shortage) << one.size.count();
  }
  if (sizes.size() > 1) {
    EXPECT_EQ(sizes.back().patch, 6_mm);
    EXPECT_GT(sizes.back().size, sizes.front().size);
  }
}

TEST_F(FittingSizes, MayBeThePictureAsLargeAsItIsInSmallerPatches) {
  // A strip 9 mm wide, of which a patch of 14 mm gets nothing.
  const StockPanel panel = free_panel(400, 18);
  EXPECT_THAT(found(test::blob_artwork("A", 60, 60, 28_mm, 1), panel, of_patch(14_mm)),
              ElementsAre(FittingSize{28_mm, 7_mm}));
}

TEST_F(FittingSizes, AreNoneWhereNothingThatIsTriedFits) {
  EXPECT_THAT(found(test::blob_artwork("A", 60, 60, 60_mm, 1), free_panel(400, 6), of_patch(14_mm)), IsEmpty());
}

TEST_F(FittingSizes, HaveNoPatchesThatGetLost) {
  EXPECT_EQ(smaller_patch(of_patch(14_mm), 5_mm), 7_mm);
  EXPECT_EQ(smaller_patch(of_patch(11_mm), 5_mm), Millimetres(5.5));
  EXPECT_EQ(smaller_patch(of_patch(Millimetres(13.9)), 5_mm), Millimetres(6.5)) << "half of it, rounded down to 0.5 mm";
  EXPECT_EQ(smaller_patch(of_patch(9_mm), 5_mm), std::nullopt);
  PlanOptions large = of_patch(14_mm);
  large.min_size = 8_mm;
  EXPECT_EQ(smaller_patch(large, 5_mm), std::nullopt);
}

TEST_F(FittingSizes, AreLookedForNoLongerThanAllowed) {
  const StockPanel panel = free_panel(100, 100);
  const Artwork artwork = test::blob_artwork("A", 60, 60, 60_mm, 1);
  limits.time = std::chrono::seconds(1);
  const auto none = fitting_sizes(artwork, {&panel, 1}, of_patch(12_mm), limits, Running());
  ASSERT_TRUE(none.ok()) << none.error().message;
  EXPECT_THAT(none->sizes, IsEmpty());
  EXPECT_EQ(none->tried, 0) << "which says nothing of the wood";
  std::stop_source asked;
  asked.request_stop();
  const auto stopped = fitting_sizes(artwork, {&panel, 1}, of_patch(12_mm), limits, clock, {}, asked.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

TEST_F(FittingSizes, LeaveTheIndexOfTheWoodAsItIs) {
  const testing::TempDirectory folder;
  PlanOptions options = of_patch(12_mm);
  options.index_cache = folder.path().string();
  found(test::blob_artwork("A", 60, 60, 60_mm, 1), free_panel(100, 100), options);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(FittingSizes, AreToldInWords) {
  EXPECT_EQ(words_of({{45_mm, 10_mm}}), "with its shorter side 45 mm and patches of 10 mm");
  EXPECT_EQ(words_of({{45_mm, 11_mm}, {60_mm, Millimetres(5.5)}}),
            "with its shorter side 45 mm and patches of 11 mm, or 60 mm and patches of 5.5 mm");
}

}  // namespace
}  // namespace veneer::planner
