#include "planner/matching/place_bits.h"

#include <gtest/gtest.h>

#include "planner/matching/free_wood.h"
#include "planner/matching/shortlist_matcher.h"
#include "planner/problem/problem.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

// All places of all lattices, against FreeWood.
void compare(const Problem& problem, const std::vector<PlaceBits>& bits, const std::vector<Lattice>& lattices,
             const FreeWood& wood) {
  const MatchPatch& patch = problem.queue.front().match;
  std::int64_t set = 0, free = 0;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    for (int y = 0; y < bits[i].height(); ++y) {
      for (int x = 0; x < bits[i].width(); ++x) {
        const auto at = panel_from_artwork(lattices[i], problem.panels.front().features, patch.grid, patch.pixels.left,
                                           patch.pixels.top, x, y);
        const bool admitted = wood.admits(at * patch.outline);
        ASSERT_TRUE(!admitted || bits[i].at(x, y)) << "a free place is lost: " << x << ", " << y;
        set += bits[i].at(x, y) ? 1 : 0, free += admitted ? 1 : 0;
        ASSERT_EQ(bits[i].any(x, x + 1, y, y + 1), bits[i].at(x, y));
      }
    }
  }
  EXPECT_GT(free, 0);
  EXPECT_LT(set, free + free / 8) << "and few others are kept";
}

TEST(PlaceBits, KeepEveryFreePlaceAndHardlyAnyOther) {
  const std::vector<Artwork> artworks{test::blob_artwork("A", 30, 30, 16_mm, 1)};
  const std::vector<StockPanel> stock{test::wood_panel("P", 90, 70, 50.8, 2)};
  PlanOptions options;
  options.patch = 8_mm, options.dpi = 50.8;
  auto problem = make_problem(artworks, stock, options);
  ASSERT_TRUE(problem.ok()) << problem.error().message;
  const MatchPanel& panel = problem->panels.front();
  const WindowClass& windows = problem->classes.front();
  FreeWood wood = panel.wood;
  const BlockedPixels blocked =
      *blocked_pixels(wood.raster(), panel.features.resolution.to_mm(Pixels(windows.right - windows.left)), {});
  std::vector<Lattice> lattices;
  std::vector<PlaceBits> bits;
  for (const Radians turn : turns(7)) {
    lattices.emplace_back(panel.features.pixels.cols, panel.features.pixels.rows, turn);
    bits.push_back(*PlaceBits::make(lattices.back(), windows, panel.features, blocked, wood.border(), {}));
  }
  compare(*problem, bits, lattices, wood);

  // After a piece was taken, the same holds.
  const MatchPatch& patch = problem->queue.front().match;
  for (int x = 0; x < bits[1].width(); ++x) {
    const auto at = panel_from_artwork(lattices[1], panel.features, patch.grid, patch.pixels.left, patch.pixels.top, x,
                                       bits[1].height() / 3);
    if (!wood.admits(at * patch.outline)) continue;
    wood.allocate(at * patch.outline);
    const auto taken = grown_rings(at * patch.outline, wood.kerf());
    for (PlaceBits& it : bits) it.remove(taken, panel.features, wood.kerf());
    break;
  }
  compare(*problem, bits, lattices, wood);
}

}  // namespace
}  // namespace veneer::planner
