#include "planner/suggest/picture_sketch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "planner/cutting/cut_drawing.h"
#include "planner/files/preview.h"
#include "planner/layout/pinned_vertices.h"
#include "planner/matching/free_wood.h"
#include "planner/suggest/suggestions.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// 152 x 127 mm of wood, and 80 mm of picture in 8 x 8 patches.
StockPanel sketched_panel() { return test::wood_panel("P", 450, 375, kSketchDpi, 3); }
Artwork sketched_artwork() { return test::blob_artwork("A", 160, 160, Millimetres(80), 4); }
PlanOptions sketched_options() {
  PlanOptions options = test::small_options_without_saliency();
  options.patch = Millimetres(10), options.dpi = kSketchDpi, options.rotations = 15;
  options.kerf = Millimetres(0.2), options.position_margin = Millimetres(0.2);
  return options;
}

PictureSketch sketched(const Artwork& artwork, const StockPanel& panel, const PlanOptions& options) {
  auto out = sketch_picture(artwork, {&panel, 1}, options);
  if (!out.ok()) throw std::runtime_error(out.error().message);
  return std::move(*out);
}

TEST(PictureSketch, UsesNoWoodTwiceAndNoneThatIsNotFree) {
  const StockPanel panel = sketched_panel();
  const PlanOptions options = sketched_options();
  const PictureSketch sketch = sketched(sketched_artwork(), panel, options);
  ASSERT_EQ(sketch.plan.pieces.size(), 64U);
  FreeWood wood(panel.free, options.kerf_and_web(), options.margin_and_web());
  for (const Piece& piece : sketch.plan.pieces) {
    ASSERT_TRUE(piece.placement) << piece.mark;
    EXPECT_TRUE(wood.admits(piece.panel_outline())) << piece.mark;
    wood.allocate(piece.panel_outline());
  }
  EXPECT_EQ(unfilled(sketch.plan), 0U);
  EXPECT_THAT(sketch.remarks, IsEmpty());
}

constexpr double kBand = 0.08;  // of likeness, which lies between 0 and 1

// A person who moves a slider decides by it.
TEST(PictureSketch, ResemblesThePlanAtFullResolution) {
  const StockPanel panel = sketched_panel();
  const Artwork artwork = sketched_artwork();
  for (const double w_edge : {0.0, 0.5}) {
    PlanOptions options = sketched_options();
    options.w_edge = w_edge;
    const PictureSketch sketch = sketched(artwork, panel, options);
    const Plan plan = test::planned({artwork}, {panel}, options);
    const auto preview = assemble_preview(plan, 0, {&panel, 1}, ScanResolution::from_dpi(kSketchDpi));
    ASSERT_TRUE(preview.ok());
    EXPECT_EQ(sketch.preview.size(), preview->pixels.size());
    EXPECT_NEAR(sketch.likeness, likeness(preview->pixels, artwork.picture), kBand) << "w_edge " << w_edge;
    EXPECT_GT(sketch.likeness, 0.5);
  }
}

TEST(PictureSketch, TellsAboutHowLongThePlanIsCut) {
  const StockPanel panel = sketched_panel();
  const PictureSketch sketch = sketched(sketched_artwork(), panel, sketched_options());
  const auto drawn = draw_cuts(sketch.plan, sketch.plan.panels.front());
  ASSERT_TRUE(drawn.ok() && sketch.cutting);
  EXPECT_GE(sketch.cutting->count(), 0.98 * drawn->estimate.count());
  EXPECT_LE(sketch.cutting->count(), 1.15 * drawn->estimate.count());
}

TEST(PictureSketch, SaysThatTheWoodIsShort) {
  const StockPanel panel = test::wood_panel("P", 180, 150, kSketchDpi, 3);  // 61 x 51 mm
  const PictureSketch sketch = sketched(sketched_artwork(), panel, sketched_options());
  EXPECT_GT(unfilled(sketch.plan), 30U);
  ASSERT_EQ(sketch.remarks.size(), 1U);
  EXPECT_THAT(sketch.remarks[0], HasSubstr("the free wood is short: "));
  EXPECT_THAT(sketch.remarks[0], HasSubstr("of 64 pieces find none"));
}

// What squares hide is what these layouts are for.
TEST(PictureSketch, HasThePlansOwnPiecesWhereItIsFine) {
  const StockPanel panel = sketched_panel();
  const Artwork artwork = sketched_artwork();
  for (const LayoutKind layout : {LayoutKind::kMorph, LayoutKind::kMosaic, LayoutKind::kSegmentation}) {
    PlanOptions options = sketched_options();
    options.layout = layout, options.rotations = 4;
    const PictureSketch squares = sketched(artwork, panel, options);
    EXPECT_EQ(squares.layout, LayoutKind::kGrid);
    EXPECT_TRUE(squares.plan.layouts.empty());
    const auto fine = sketch_picture(artwork, {&panel, 1}, options, GridEffort::kFine);
    ASSERT_TRUE(fine.ok()) << fine.error().message;
    EXPECT_EQ(fine->layout, layout);
    ASSERT_EQ(fine->plan.layouts.size(), 1U);
    EXPECT_EQ(fine->plan.layouts[0].faces.size(), fine->plan.pieces.size());
    EXPECT_EQ(unfilled(fine->plan), 0U);
    EXPECT_EQ(fine->preview.size(), squares.preview.size());
    const Plan plan = test::planned({artwork}, {panel}, options);
    const auto preview = assemble_preview(plan, 0, {&panel, 1}, ScanResolution::from_dpi(kSketchDpi));
    ASSERT_TRUE(preview.ok());
    EXPECT_NEAR(fine->likeness, likeness(preview->pixels, artwork.picture), kBand) << static_cast<int>(layout);
    EXPECT_GT(cv::norm(fine->preview, squares.preview, cv::NORM_INF), 0);
    FreeWood wood(panel.free, options.kerf_and_web(), options.margin_and_web());
    for (const Piece& piece : fine->plan.pieces) {
      EXPECT_TRUE(wood.admits(piece.panel_outline())) << piece.mark;
      wood.allocate(piece.panel_outline());
    }
  }
  PlanOptions refined = sketched_options();
  refined.refine = Refine::kDp;
  const auto bent = sketch_picture(artwork, {&panel, 1}, refined, GridEffort::kFine);
  ASSERT_TRUE(bent.ok()) << bent.error().message;
  ASSERT_TRUE(bent->plan.refined);
  EXPECT_LT(bent->plan.refined->cost, bent->plan.refined->cost_before);
  EXPECT_FALSE(sketched(artwork, panel, refined).plan.refined) << "squares stay squares while a hand is on a slider";
}

// 6400 patches would take a hundred times as long as somebody waits.
TEST(PictureSketch, DrawsLargerPatchesWhereThereWouldBeTooMany) {
  const StockPanel panel = sketched_panel();
  PlanOptions options = sketched_options();
  options.patch = Millimetres(1);
  const PictureSketch sketch = sketched(sketched_artwork(), panel, options);
  EXPECT_LE(sketch.plan.pieces.size(), 1300U);
  EXPECT_GT(sketch.patch, Millimetres(2));
  EXPECT_FALSE(sketch.cutting) << "fewer pieces are cut sooner";
  EXPECT_THAT(sketch.remarks.back(), HasSubstr("smaller ones would take too long for a sketch"));
}

// A vertex is one of its grid, and larger patches make another.
TEST(PictureSketch, SaysThatPinsBelongToAGridOfMorePiecesThanItDraws) {
  const StockPanel panel = sketched_panel();
  Artwork artwork = sketched_artwork();
  PlanOptions options = sketched_options();
  options.layout = LayoutKind::kMorph, options.patch = Millimetres(1);
  const auto pinned = pinned_vertices_of("pinned_vertices", "1,1,1.1,78.9");
  ASSERT_TRUE(pinned.ok()) << pinned.error().message;
  artwork.guides.vertices = *pinned;
  const auto refused = sketch_picture(artwork, {&panel, 1}, options, GridEffort::kFine);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(
      refused.error().message,
      "a sketch has some 1200 pieces at most, and the pinned vertices belong to a grid of 6400: free them or choose "
      "larger pieces to see one; a plan takes them as they are");

  // Patches that are larger by a hair make the same grid: 35 x 35, of which 34.6 x 34.6 would be enough.
  options.patch = Millimetres(80 / 34.7);
  artwork.guides.vertices.front().row = 36;
  const auto same = sketch_picture(artwork, {&panel, 1}, options, GridEffort::kFine);
  ASSERT_FALSE(same.ok());
  EXPECT_THAT(same.error().message, HasSubstr("is none of the grid's: rows are 0 to 35, columns 0 to 35"));
}

TEST(PictureSketch, IsTheSameForTheSameQuestionAndEndsWhenItIsStopped) {
  const StockPanel panel = sketched_panel();
  const Artwork artwork = sketched_artwork();
  const PictureSketch a = sketched(artwork, panel, sketched_options()),
                      b = sketched(artwork, panel, sketched_options());
  EXPECT_EQ(cv::norm(a.preview, b.preview, cv::NORM_INF), 0);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = sketch_picture(artwork, {&panel, 1}, sketched_options(), GridEffort::kCoarse, stop.get_token());
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
