// Borders that follow the picture: what holds for every plan that has them.
#include "planner/boundaries/refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"
#include "planner/boundaries/curved_layout.h"
#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"
#include "planner/files/preview.h"
#include "planner/layout/fabrication.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::planned;
using test::wood_panel;
using ::testing::HasSubstr;

PlanOptions refined_options() {
  PlanOptions options;
  options.patch = 8_mm, options.dpi = 50.8, options.rotations = 4, options.threads = 1;
  options.priority = Priority::kCentre;  // saliency costs more time than all the rest here
  options.refine = Refine::kDp;
  return options;
}

bool is_whole(Millimetres length) { return length.count() == std::round(length.count() * 1000) / 1000; }

// Faces cover the artwork without gaps and overlaps, share their edges and can be made.
void assert_fabricable(const Plan& plan, const PlanOptions& options) {
  RC_ASSERT(plan.layouts.size() == plan.artworks.size());
  const FabricationLimits limits{options.min_width};
  for (std::size_t a = 0; a < plan.artworks.size(); ++a) {
    const Partition& layout = plan.layouts[a];
    std::vector<Region<ArtworkFrame>> areas;
    double sum = 0;
    std::size_t f = 0;
    for (const Piece& piece : plan.pieces) {
      if (piece.artwork != a) continue;
      RC_ASSERT(piece.artwork_outline == outline_of(layout, f));
      RC_ASSERT(!fault_of(piece.artwork_outline, limits));
      areas.emplace_back(piece.artwork_outline);
      sum += signed_area(piece.artwork_outline);
      ++f;
    }
    RC_ASSERT(f == layout.faces.size());
    const double whole = (plan.artworks[a].width * plan.artworks[a].height).count();
    RC_ASSERT(std::abs(sum - whole) <= 1e-6 * whole);
    // Regions lie on whole micrometres, which the artwork itself need not.
    const Point<ArtworkFrame> far{plan.artworks[a].width, plan.artworks[a].height};
    const Region<ArtworkFrame> artwork(Ring<ArtworkFrame>{{}, {far.x, {}}, far, {{}, far.y}});
    RC_ASSERT(std::abs((unite(areas).area() - artwork.area()).count()) <= 1e-6 * whole);
    std::map<std::size_t, int> uses;
    for (const PartitionFace& face : layout.faces)
      for (const DirectedEdge& it : face.boundary) uses[it.edge] += it.backwards ? 10 : 1;
    for (std::size_t e = 0; e < layout.edges.size(); ++e) {
      const PartitionEdge& edge = layout.edges[e];
      const bool inside = edge.left != PartitionEdge::kOutside && edge.right != PartitionEdge::kOutside;
      const bool used_once = inside ? uses[e] == 11 : (uses[e] == 1 || uses[e] == 10);
      RC_ASSERT(used_once);
      for (std::size_t k = 1; inside && k + 1 < edge.curve.size(); ++k)
        RC_ASSERT(is_whole(edge.curve[k].x) && is_whole(edge.curve[k].y));
    }
  }
}

void assert_own_wood(const Plan& plan, const std::vector<StockPanel>& stock, const PlanOptions& options) {
  for (const StockPanel& panel : stock) {
    FreeWood wood(panel.free, options.kerf - Millimetres(0.001), options.position_margin);
    std::vector<Region<PanelFrame>> allocations;
    for (const Piece& piece : plan.pieces) {
      if (!piece.placement || !(piece.placement->panel == panel.id)) continue;
      RC_ASSERT(wood.on_free_wood(piece.panel_outline()));
      allocations.push_back(offset(Region<PanelFrame>(piece.panel_outline()), options.kerf));
    }
    for (std::size_t i = 0; i < allocations.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) RC_ASSERT(intersect(allocations[i], allocations[j]).area().count() == 0.0);
  }
}

RC_GTEST_PROP(Refinement, PiecesCanBeMadeCoverThePictureAndTakeNoWoodTwice, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000000);
  PlanOptions options = refined_options();
  options.patch = Millimetres(*rc::gen::inRange(50, 110) / 10.0);
  options.kerf = Millimetres(*rc::gen::inRange(0, 40) / 100.0);
  options.curves = *rc::gen::element(Curves::kG0, Curves::kG1);
  options.overlap = Millimetres(*rc::gen::inRange(0, 40) / 10.0);
  options.rematch = *rc::gen::inRange(0, 2);
  options.layout = *rc::gen::element(LayoutKind::kGrid, LayoutKind::kMorph);
  options.adaptive_levels = options.layout == LayoutKind::kGrid ? *rc::gen::inRange(0, 2) : 0;
  options.adaptive_factor = 1.6;
  const std::vector<StockPanel> stock{wood_panel("P", 130, 100, 50.8, seed), wood_panel("Q", 80, 90, 45, seed + 9)};
  const Plan plan = planned({blob_artwork("A", 40, 52, 31_mm, seed + 1)}, stock, options);
  RC_ASSERT(plan.refined.has_value());
  RC_ASSERT(plan.refined->cost <= plan.refined->cost_refined);
  RC_ASSERT(plan.refined->cost_refined <= plan.refined->cost_before);
  RC_ASSERT(std::abs(cost_total(plan) - plan.refined->cost) <= 1e-9 * plan.refined->cost);
  assert_fabricable(plan, options);
  assert_own_wood(plan, stock, options);
}

// Mosaics, segmentations and triangles: every edge is cut by itself.
RC_GTEST_PROP(Refinement, OfAnyPartitionCoversThePictureWithPiecesThatCanBeMade, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000000);
  PlanOptions options = refined_options();
  options.patch = Millimetres(*rc::gen::inRange(50, 90) / 10.0);
  options.kerf = Millimetres(*rc::gen::inRange(0, 40) / 100.0);
  options.curves = *rc::gen::element(Curves::kG0, Curves::kG1);
  options.overlap = Millimetres(*rc::gen::inRange(0, 40) / 10.0);
  options.rematch = *rc::gen::inRange(0, 2);
  options.layout = *rc::gen::element(LayoutKind::kMorph, LayoutKind::kMosaic, LayoutKind::kSegmentation);
  options.triangles = options.layout == LayoutKind::kMorph;
  const std::vector<StockPanel> stock{wood_panel("P", 130, 100, 50.8, seed), wood_panel("Q", 80, 90, 45, seed + 9)};
  const Plan plan = planned({blob_artwork("A", 40, 52, 31_mm, seed + 1)}, stock, options);
  RC_ASSERT(plan.refined->cost <= plan.refined->cost_refined);
  RC_ASSERT(plan.refined->cost_refined <= plan.refined->cost_before);
  RC_ASSERT(std::abs(cost_total(plan) - plan.refined->cost) <= 1e-9 * plan.refined->cost);
  assert_fabricable(plan, options);
  assert_own_wood(plan, stock, options);
}

class Refined : public ::testing::Test {
 protected:
  const std::vector<StockPanel> stock_{wood_panel("P", 260, 200, 101.6, 21), wood_panel("Q", 160, 180, 101.6, 22)};
  const std::vector<Artwork> artworks_{blob_artwork("A", 60, 50, 33.3335_mm, 23), blob_artwork("B", 40, 40, 16_mm, 24)};
  static PlanOptions options() {
    PlanOptions options = refined_options();
    options.dpi = 101.6;
    return options;
  }
};

TEST_F(Refined, ShowThePictureBetterThanStraightOnesAndWoodChosenAgainBetterStill) {
  PlanOptions straight = options();
  straight.refine = Refine::kNone;
  PlanOptions again = options();
  again.rematch = 3;
  const auto shown = [&](const Plan& plan) {
    PreviewCost cost;
    for (std::size_t a = 0; a < plan.artworks.size(); ++a)
      cost += *preview_cost(plan, a, *assemble_preview(plan, a, stock_, ScanResolution::from_dpi(plan.dpi)), straight);
    return *cost.per_pixel();
  };
  const Plan grid = planned(artworks_, stock_, straight), refined = planned(artworks_, stock_, options()),
             rematched = planned(artworks_, stock_, again);
  EXPECT_TRUE(grid.layouts.empty() && !grid.refined);
  EXPECT_DOUBLE_EQ(refined.refined->cost_before, cost_total(grid));
  EXPECT_LT(refined.refined->cost, refined.refined->cost_before);
  EXPECT_LT(shown(refined), shown(grid));
  ASSERT_FALSE(rematched.refined->rounds.empty());
  EXPECT_EQ(rematched.refined->cost_refined, refined.refined->cost);
  EXPECT_LT(rematched.refined->cost, refined.refined->cost);
  EXPECT_LT(shown(rematched), shown(refined));
}

// How far one edge's place is from where it was, at most.
double farthest_move(const Partition& before, const Partition& after) {
  double most = 0;
  for (std::size_t e = 0; e < before.edges.size(); ++e)
    for (const Point<ArtworkFrame>& p : flattened(after.edges[e])) {
      double nearest = 1e9;
      const Polyline<ArtworkFrame> path = flattened(before.edges[e]);
      for (std::size_t i = 1; i < path.size(); ++i) {
        const auto &a = path[i - 1], &b = path[i];
        const double dx = (b.x - a.x).count(), dy = (b.y - a.y).count();
        const double t =
            std::clamp(((p.x - a.x).count() * dx + (p.y - a.y).count() * dy) / (dx * dx + dy * dy), 0.0, 1.0);
        nearest = std::min(nearest, std::hypot((p.x - a.x).count() - t * dx, (p.y - a.y).count() - t * dy));
      }
      most = std::max(most, nearest);
    }
  return most;
}

class RefinedFreely : public Refined {
 protected:
  static PlanOptions options_of(LayoutKind layout) {
    PlanOptions out = refined_options();
    out.layout = layout, out.triangles = layout == LayoutKind::kMorph;
    return out;
  }
  PreviewCost shown(const Plan& plan, const PlanOptions& options) const {
    PreviewCost cost;
    for (std::size_t a = 0; a < plan.artworks.size(); ++a)
      cost += *preview_cost(plan, a, *assemble_preview(plan, a, stock_, ScanResolution::from_dpi(plan.dpi)), options);
    return cost;
  }
};

TEST_F(RefinedFreely, ShowThePictureBetterWhateverTheyWereLaidOutBy) {
  for (const LayoutKind layout : {LayoutKind::kMosaic, LayoutKind::kSegmentation, LayoutKind::kMorph}) {
    PlanOptions plain = options_of(layout), refined = plain;
    plain.refine = Refine::kNone;
    const Plan before = planned(artworks_, stock_, plain), after = planned(artworks_, stock_, refined);
    EXPECT_DOUBLE_EQ(after.refined->cost_before, cost_total(before));
    EXPECT_LT(after.refined->cost, after.refined->cost_before);
    EXPECT_LT(*shown(after, refined).per_pixel(), *shown(before, plain).per_pixel());
    ASSERT_EQ(after.layouts.size(), before.layouts.size());
    for (std::size_t a = 0; a < before.layouts.size(); ++a) {
      // Pieces keep their marks, their neighbours and their corners.
      ASSERT_EQ(after.layouts[a].faces, before.layouts[a].faces);
      for (std::size_t e = 0; e < before.layouts[a].edges.size(); ++e) {
        EXPECT_EQ(after.layouts[a].edges[e].curve.front(), before.layouts[a].edges[e].curve.front());
        EXPECT_EQ(after.layouts[a].edges[e].curve.back(), before.layouts[a].edges[e].curve.back());
      }
      EXPECT_GT(farthest_move(before.layouts[a], after.layouts[a]), 0.2);
    }
  }
}

TEST_F(RefinedFreely, TakeOtherWoodForTheirNewShapes) {
  PlanOptions again = options_of(LayoutKind::kMosaic);
  again.rematch = 1;
  const Plan plan = planned(artworks_, stock_, again);
  ASSERT_FALSE(plan.refined->rounds.empty());
  EXPECT_GT(plan.refined->rounds.front().moved, 0U);
  EXPECT_LT(plan.refined->cost, plan.refined->cost_refined);
}

TEST_F(RefinedFreely, GoNoFartherThanTheirOverlap) {
  PlanOptions plain = options_of(LayoutKind::kMosaic), near = plain;
  plain.refine = Refine::kNone, near.overlap = 0.8_mm;
  const Plan before = planned(artworks_, stock_, plain), after = planned(artworks_, stock_, near);
  EXPECT_LE(farthest_move(before.layouts[0], after.layouts[0]), 0.8 + kFitTolerance.count() + 0.01);
  EXPECT_LT(after.refined->cost, after.refined->cost_before);
}

TEST_F(RefinedFreely, AreTheSameForAnyNumberOfThreads) {
  PlanOptions one = options_of(LayoutKind::kMosaic), three = one;
  three.threads = 3;
  EXPECT_EQ(plan_to_json(planned(artworks_, stock_, one)), plan_to_json(planned(artworks_, stock_, three)));
}

TEST_F(RefinedFreely, LeaveHolesAsTheyAre) {
  const PlanOptions scarce = options_of(LayoutKind::kMosaic);
  const std::vector<StockPanel> little{wood_panel("P", 160, 120, 101.6, 25)};
  PlanOptions plain = scarce;
  plain.refine = Refine::kNone;
  const Plan before = planned(artworks_, little, plain), plan = planned(artworks_, little, scarce);
  ASSERT_GT(unfilled(plan), 0U);
  EXPECT_EQ(unfilled(plan), unfilled(before));
  assert_fabricable(plan, scarce);
  assert_own_wood(plan, little, scarce);
}

// Specks of a tenth of a millimetre, a fine mask's, every 10.5 mm: a coarse look at a place overlooks them.
StockPanel with_specks(StockPanel panel) {
  constexpr double kFine = 254;
  const double scale = kFine / panel.free.resolution.dpi();
  cv::resize(panel.free.pixels, panel.free.pixels, {}, scale, scale, cv::INTER_NEAREST);
  panel.free.resolution = ScanResolution::from_dpi(kFine);
  for (int r = 45; r < panel.free.pixels.rows; r += 105)
    for (int c = 45; c < panel.free.pixels.cols; c += 105) panel.free.pixels.at<std::uint8_t>(r, c) = 0;
  return panel;
}

TEST_F(Refined, TakeTheWoodThatIsTheirsWhenOtherPiecesAreRefusedTheirs) {
  const std::vector<StockPanel> specked{with_specks(stock_[0]), with_specks(stock_[1])};
  PlanOptions again = options();
  again.rematch = 3;
  const Plan plan = planned(artworks_, specked, again);
  // Pieces are refused in the second round, which would be the last otherwise, and taken back.
  EXPECT_EQ(plan.refined->rounds.size(), 2U);
  assert_own_wood(plan, specked, again);
}

TEST_F(Refined, HaveCurvesOfThreeMillimetresOnTheMean) {
  const Plan plan = planned(artworks_, stock_, options());
  EXPECT_GE(plan.refined->length.count() / static_cast<double>(plan.refined->segments), 3);
}

TEST_F(Refined, SayHowFarTheyLieBesideThePixelsCut) {
  const Plan plan = planned(artworks_, stock_, options());
  ASSERT_TRUE(plan.refined->pixel_cut.has_value());
  EXPECT_GT(plan.refined->pixel_cut->mean.count(), 0) << "the pixels' cut goes in steps";
  EXPECT_GE(plan.refined->pixel_cut->most, plan.refined->pixel_cut->mean);
  EXPECT_LE(plan.refined->pixel_cut->mean.count(), 0.25);
}

TEST_F(Refined, AreTheSameForAnyNumberOfThreads) {
  PlanOptions one = options(), three = options();
  one.rematch = three.rematch = 1, three.threads = 3;
  EXPECT_EQ(plan_to_json(planned(artworks_, stock_, one)), plan_to_json(planned(artworks_, stock_, three)));
}

TEST_F(Refined, ComeBackFromTheirFile) {
  const Plan plan = planned(artworks_, stock_, options());
  const std::string text = plan_to_json(plan);
  const auto back = plan_from_json(text);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(plan_to_json(*back), text);
  EXPECT_EQ(back->layouts, plan.layouts);
  auto broken = nlohmann::json::parse(text);
  broken["pieces"][0]["edges"][0] = -broken["pieces"][0]["edges"][0].get<int>();
  EXPECT_THAT(plan_from_json(broken.dump()).error().message, HasSubstr("is not what its edges make"));
  broken["pieces"][0]["edges"][0] = 100000;
  EXPECT_THAT(plan_from_json(broken.dump()).error().message, HasSubstr("names no edge"));
  broken = nlohmann::json::parse(text);
  broken["layouts"][0]["edges"][0]["curve_um"].erase(0);
  EXPECT_THAT(plan_from_json(broken.dump()).error().message, HasSubstr("no row of cubic curves"));
}

TEST_F(Refined, KeepTheirShapesWhenThePlanIsKept) {
  const Plan plan = planned(artworks_, stock_, options());
  PlanOptions keeping = options();
  keeping.refine = Refine::kNone;
  ASSERT_TRUE(keep_edited(plan, {.pins = {}, .replanned = {"A2-2", "B1-2"}, .swaps = {}, .takes = {}}, keeping).ok());
  const Plan again = planned(artworks_, stock_, keeping);
  ASSERT_EQ(again.pieces.size(), plan.pieces.size());
  for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
    EXPECT_EQ(again.pieces[i].mark, plan.pieces[i].mark);
    EXPECT_EQ(again.pieces[i].artwork_outline, plan.pieces[i].artwork_outline);
    EXPECT_TRUE(again.pieces[i].placement.has_value());
    if (plan.pieces[i].mark == "A2-2" || plan.pieces[i].mark == "B1-2") continue;
    EXPECT_EQ(again.pieces[i].panel_outline(), plan.pieces[i].panel_outline()) << plan.pieces[i].mark;
  }
  EXPECT_EQ(again.layouts, plan.layouts);
  assert_own_wood(again, stock_, keeping);
}

TEST_F(Refined, LeaveHolesAsTheyAre) {
  PlanOptions scarce = options();
  const std::vector<StockPanel> little{wood_panel("P", 160, 120, 101.6, 25)};
  const Plan plan = planned(artworks_, little, scarce);
  ASSERT_GT(unfilled(plan), 0U);
  assert_fabricable(plan, scarce);
  assert_own_wood(plan, little, scarce);
}

TEST_F(Refined, SayWhichPiecesCannotBeMade) {
  PlanOptions wide = options();
  wide.patch = 4_mm, wide.min_width = 5_mm;
  const Plan plan = planned(artworks_, stock_, wide);
  EXPECT_THAT(plan.warnings, ::testing::Contains(HasSubstr("A1-1 is too small to be handled")));
}

TEST_F(Refined, MoveWherePiecesCanBeMadeThoughOthersCannot) {
  PlanOptions two_sizes = options();
  two_sizes.patch = 4_mm, two_sizes.adaptive_levels = 1, two_sizes.adaptive_factor = 1.4, two_sizes.min_width = 3.2_mm;
  // As many large patches as make sure that two of them meet; the small ones are too small.
  Plan plan;
  std::ptrdiff_t large = 0;
  while (large < 8 && two_sizes.adaptive_factor < 9) {
    two_sizes.adaptive_factor += 0.2;
    plan = planned(artworks_, stock_, two_sizes);
    large = std::ranges::count_if(plan.pieces, [](const Piece& piece) { return piece.cells == 2; });
  }
  ASSERT_GE(large, 8);
  EXPECT_THAT(plan.warnings, ::testing::Contains(HasSubstr("is too small to be handled")));
  EXPECT_LT(plan.refined->cost_refined, plan.refined->cost_before);
  assert_own_wood(plan, stock_, two_sizes);
}

TEST_F(Refined, RefuseWhatDoesNotGoTogether) {
  const auto refused = [&](const std::function<void(PlanOptions&)>& change) {
    PlanOptions changed = options();
    change(changed);
    const auto plan = make_plan(artworks_, stock_, changed);
    return plan.ok() ? "" : plan.error().message;
  };
  EXPECT_THAT(refused([](PlanOptions& o) { o.rematch = 101; }), HasSubstr("from 0 to 100 times"));
  EXPECT_THAT(refused([](PlanOptions& o) {
                o.kept = {KeptPiece{"A1-1", 1, {}, false, {}}};
              }),
              HasSubstr("keeps its borders too"));
  EXPECT_THAT(refused([](PlanOptions& o) { o.alternatives = 1; }), HasSubstr("final"));
  EXPECT_THAT(refused([](PlanOptions& o) { o.min_width = Millimetres(0); }), HasSubstr("least width"));
}

TEST_F(Refined, AreNoPlanWhenPlanningIsStopped) {
  std::stop_source stop;
  const auto plan = make_plan(
      artworks_, stock_, options(),
      [&](double, std::string_view text) {
        if (text == "refining borders") stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
