#include "planner/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "base/polygon_ops.h"
#include "planner/edits/plan_edits.h"
#include "planner/files/plan_files.h"
#include "planner/files/preview.h"
#include "planner/pictures/features.h"
#include "planner/pictures/histogram.h"
#include "planner/pictures/resample.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::planned;
using test::small_options;
using test::wood_panel;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

std::string error_of(const std::vector<Artwork>& artworks, const std::vector<StockPanel>& stock,
                     const PlanOptions& options) {
  const auto plan = make_plan(artworks, stock, options);
  if (plan.ok()) return "none";
  EXPECT_EQ(plan.error().code, ErrorCode::kInvalidArgument);
  return plan.error().message;
}

TEST(Plan, OutlinesAreRigidUnmirroredCopiesWithTheSameVertices) {
  const Plan plan =
      planned({blob_artwork("A", 50, 40, 28_mm, 1)}, {wood_panel("P", 150, 110, 50.8, 2)}, small_options());
  ASSERT_EQ(plan.pieces.size(), 4U * 5U);
  for (const Piece& piece : plan.pieces) {
    ASSERT_TRUE(piece.placement) << piece.mark;
    const auto& a = piece.artwork_outline;
    const auto& p = piece.panel_outline();
    ASSERT_EQ(a.size(), p.size());
    EXPECT_NEAR(signed_area(a), signed_area(p), 1e-9);
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) EXPECT_NEAR(distance(a[i], a[j]).count(), distance(p[i], p[j]).count(), 1e-9);
      EXPECT_NEAR(distance(p[i], piece.placement->panel_from_artwork * a[i]).count(), 0, 1e-9);
    }
    const double turns = to_degrees(piece.placement->panel_from_artwork.angle()) / 72;
    EXPECT_NEAR(turns, std::round(turns), 1e-9);
  }
}

RC_GTEST_PROP(Plan, NoWoodIsTakenTwiceAndNoneThatIsNotFree, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000000);
  PlanOptions options = small_options();
  options.priority = Priority::kCentre;  // saliency costs more time than all the rest here
  options.kerf = Millimetres(*rc::gen::inRange(0, 50) / 100.0);
  options.rotations = *rc::gen::inRange(1, 8);
  options.patch = Millimetres(*rc::gen::inRange(40, 110) / 10.0);
  const std::vector<StockPanel> stock{wood_panel("P", 60, 48, 50.8, seed), wood_panel("Q", 45, 40, 45, seed + 9)};
  const Plan plan = planned({blob_artwork("A", 40, 40, 28_mm, seed + 1)}, stock, options);
  for (const StockPanel& panel : stock) {
    std::vector<Region<PanelFrame>> allocations;
    for (const Piece& piece : plan.pieces)
      if (piece.placement && piece.placement->panel == panel.id)
        allocations.push_back(offset(Region<PanelFrame>(piece.panel_outline()), options.kerf));
    for (std::size_t i = 0; i < allocations.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) RC_ASSERT(intersect(allocations[i], allocations[j]).area().count() == 0.0);
    // Runs of pixels that are not free, as polygons.
    std::vector<Region<PanelFrame>> blocked;
    const cv::Mat& free = panel.free.pixels;
    for (int r = 0; r < free.rows; ++r) {
      for (int c = 0, end = 0; c < free.cols; c = end + 1) {
        for (end = c; end < free.cols && free.at<std::uint8_t>(r, end) == 0;) ++end;
        if (end > c)
          blocked.emplace_back(Ring<PanelFrame>{panel.free.from_pixels(c, r + 1), panel.free.from_pixels(end, r + 1),
                                                panel.free.from_pixels(end, r), panel.free.from_pixels(c, r)});
      }
    }
    RC_ASSERT(intersect(unite(blocked), unite(allocations)).area().count() == 0.0);
  }
}

// The contract's cost, written down a second time from the plan's own outlines.
double measured_cost(const Ring<ArtworkFrame>& outline, const Placement& placement, const Artwork& artwork,
                     const std::vector<StockPanel>& stock, const PlanOptions& options, std::int64_t& pixels) {
  const StockPanel& panel = placement.panel == stock[0].id ? stock[0] : stock[1];
  const double px_per_mm = options.dpi / 25.4;
  GreyHistogram tones;
  for (const StockPanel& p : stock) tones.add(grey_of(p.picture.pixels), p.free.pixels);
  const int width = static_cast<int>(std::lround(artwork.width.count() * px_per_mm));
  const int height = static_cast<int>(std::lround(artwork.height.count() * px_per_mm));
  const cv::Mat grey = grey_of(stretch(artwork.picture, width, height));
  const Pixels scale = ScanResolution{px_per_mm}.to_px(options.edge);
  const cv::Mat tone = match_tones(grey, tones, options.w_hist), edge = edges_at_scale(grey, scale);
  const cv::Mat wood = grey_of(panel.picture.pixels), wood_edge = edges_at_scale(wood, scale);
  // Hue, saturation, lines and spots as the filters find them (features_test.cc).
  PlanOptions further = options;
  further.w_intensity = further.w_edge = 0;
  std::vector<cv::Mat> target_channels, wood_channels;
  if (further.w_colour + further.w_texture > 0) {
    const cv::Mat shown = stretch(artwork.picture, width, height);
    cv::split(filter_bank({shown, grey, tone, ScanResolution{px_per_mm}}, further), target_channels);
    cv::split(filter_bank({panel.picture.pixels, wood, wood, panel.picture.resolution}, further), wood_channels);
  }
  const auto sample = [](const cv::Mat& map, double x, double y) {
    const int c = std::clamp(static_cast<int>(std::floor(x - 0.5)), 0, map.cols - 2);
    const int r = std::clamp(static_cast<int>(std::floor(y - 0.5)), 0, map.rows - 2);
    const double fx = std::clamp(x - 0.5 - c, 0.0, 1.0), fy = std::clamp(y - 0.5 - r, 0.0, 1.0);
    return (1 - fy) * ((1 - fx) * map.at<float>(r, c) + fx * map.at<float>(r, c + 1)) +
           fy * ((1 - fx) * map.at<float>(r + 1, c) + fx * map.at<float>(r + 1, c + 1));
  };
  const Box<ArtworkFrame> box = bounds(outline);
  double cost = 0;
  pixels = 0;
  for (int r = 0; r < height; ++r) {
    for (int c = 0; c < width; ++c) {
      const Point<ArtworkFrame> at{Millimetres((c + 0.5) / px_per_mm),
                                   artwork.height - Millimetres((r + 0.5) / px_per_mm)};
      if (at.x < box.min.x || at.x >= box.max.x || at.y <= box.min.y || at.y > box.max.y) continue;
      const Point<PanelFrame> on = placement.panel_from_artwork * at;
      const double x = on.x.count() * px_per_mm, y = wood.rows - on.y.count() * px_per_mm;
      const double di = sample(wood, x, y) - tone.at<float>(r, c), de = sample(wood_edge, x, y) - edge.at<float>(r, c);
      cost += options.w_intensity * options.w_intensity * di * di + options.w_edge * options.w_edge * de * de;
      for (std::size_t k = 0; k < wood_channels.size(); ++k) {
        const double d = sample(wood_channels[k], x, y) - target_channels[k].at<float>(r, c);
        cost += d * d;
      }
      ++pixels;
    }
  }
  return cost;
}

struct CostCase {
  const char* name;
  std::function<void(PlanOptions&)> change;
  bool kept = false;  // planned again around what was swapped
};

class CostsOfPlan : public ::testing::TestWithParam<CostCase> {};

TEST_P(CostsOfPlan, AreWhatThePlacedWoodMeasures) {
  PlanOptions options = small_options();
  options.w_intensity = 0.7, options.w_edge = 0.4, options.w_hist = 0.6;
  GetParam().change(options);
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 21), wood_panel("Q", 80, 60, 50.8, 22)};
  const Artwork artwork = blob_artwork("A", 56, 42, 21_mm, 23);
  Plan plan = planned({artwork}, stock, options);
  if (GetParam().kept) {
    ASSERT_TRUE(swap_pieces(plan, "A1-1", "A3-3").ok());
    const std::vector<std::string> must{"A1-1", "A3-3"}, replanned{"A2-2"};
    options.kept = *kept_pieces(plan, Keep::kAll, must, replanned);
    plan = planned({artwork}, stock, options);
  }
  double total = 0;
  std::int64_t all_pixels = 0;
  for (const Piece& piece : plan.pieces) {
    ASSERT_TRUE(piece.placement);
    std::int64_t pixels = 0;
    const double cost = measured_cost(piece.artwork_outline, *piece.placement, artwork, stock, options, pixels);
    EXPECT_NEAR(piece.cost, cost, 1e-5 * cost) << piece.mark;
    EXPECT_EQ(piece.pixels, pixels);
    total += cost, all_pixels += pixels;
    for (const Alternative& other : piece.alternatives) {
      const double there = measured_cost(piece.artwork_outline, other.placement, artwork, stock, options, pixels);
      EXPECT_NEAR(other.cost, there, 1e-5 * there) << piece.mark;
    }
  }
  EXPECT_NEAR(cost_total(plan), total, 1e-5 * total);
  EXPECT_NEAR(cost_per_pixel(plan), total / static_cast<double>(all_pixels), 1e-5 * cost_per_pixel(plan));
}

INSTANTIATE_TEST_SUITE_P(
    HoweverItIsPlanned, CostsOfPlan,
    ::testing::Values(
        CostCase{"Greedy", [](PlanOptions& o) { o.alternatives = 2; }},
        CostCase{"FineRotation", [](PlanOptions& o) { o.fine_rotation = true; }},
        CostCase{"Global", [](PlanOptions& o) { o.optimize = Optimize::kGlobal, o.optimize_iterations = 5000; }},
        CostCase{"GlobalWithGrain",
                 [](PlanOptions& o) { o.optimize = Optimize::kGlobal, o.optimize_iterations = 5000, o.w_grain = 0.4; }},
        CostCase{"Adaptive", [](PlanOptions& o) { o.patch = 3.5_mm, o.adaptive_levels = 1; }},
        CostCase{"EdgesAtAScale", [](PlanOptions& o) { o.edge = 0.7_mm; }},
        CostCase{"ColourAndTexture", [](PlanOptions& o) { o.w_colour = 0.6, o.w_texture = 0.3; }},
        CostCase{"KeptAndSwapped", [](PlanOptions&) {}, true}),
    [](const auto& it) { return std::string(it.param.name); });

TEST(Plan, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Artwork> artworks{blob_artwork("A", 50, 50, 42_mm, 31), blob_artwork("B", 40, 50, 28_mm, 32)};
  const std::vector<StockPanel> stock{wood_panel("P", 130, 100, 50.8, 33), wood_panel("Q", 70, 90, 60, 34)};
  PlanOptions options = small_options();
  const std::string alone = plan_to_json(planned(artworks, stock, options));
  for (const int threads : {2, 3, 7}) {
    options.threads = threads;
    EXPECT_EQ(plan_to_json(planned(artworks, stock, options)), alone) << threads << " threads";
  }
}

TEST(Plan, FinishesWithUnfilledPatchesWhenWoodRunsOut) {
  const Plan plan =
      planned({blob_artwork("A", 40, 40, 70_mm, 41)}, {wood_panel("P", 60, 60, 50.8, 42)}, small_options());
  EXPECT_EQ(plan.pieces.size(), 100U);
  EXPECT_GT(unfilled(plan), 70U);
  EXPECT_LT(unfilled(plan), 100U);
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement) {
      EXPECT_EQ(piece.cost, 0);
    }
  }
}

TEST(Plan, StopsWhenAsked) {
  std::stop_source stop;
  int calls = 0;
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 70_mm, 51)};
  const std::vector<StockPanel> stock{wood_panel("P", 200, 200, 50.8, 52)};
  const auto plan = make_plan(
      artworks, stock, small_options(),
      [&](double, std::string_view) {
        ++calls;
        stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(calls, 1);
}

TEST(Plan, ProgressRisesToOne) {
  double last = -1;
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 21_mm, 51)};
  const std::vector<StockPanel> stock{wood_panel("P", 100, 100, 50.8, 52)};
  ASSERT_TRUE(make_plan(artworks, stock, small_options(), [&](double fraction, std::string_view text) {
                EXPECT_GE(fraction, last);
                EXPECT_FALSE(text.empty());
                last = fraction;
              }).ok());
  EXPECT_EQ(last, 1);
}

TEST(Plan, RefusesUnusableInputInWords) {
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 28_mm, 1)};
  const std::vector<StockPanel> stock{wood_panel("P", 100, 100, 50.8, 2)};
  const PlanOptions good = small_options();
  EXPECT_EQ(error_of(artworks, stock, good), "none");
  EXPECT_NE(error_of({}, stock, good), "none");
  EXPECT_NE(error_of(artworks, {}, good), "none");

  PlanOptions options = good;
  options.w_intensity = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(artworks, stock, options).find("intensity weight"), std::string::npos);
  options = good, options.w_edge = 1.5;
  EXPECT_NE(error_of(artworks, stock, options).find("edge weight"), std::string::npos);
  options = good, options.w_edge = options.w_intensity = 0;
  EXPECT_NE(error_of(artworks, stock, options).find("all filters are 0"), std::string::npos);
  options = good, options.patch = 60_mm;
  EXPECT_NE(error_of({blob_artwork("A", 40, 40, 60_mm, 1)}, stock, options).find("larger than every panel"),
            std::string::npos);
  options = good, options.patch = 1_mm;
  EXPECT_NE(error_of(artworks, stock, options).find("larger patches"), std::string::npos);
  options = good, options.rotations = 0;
  EXPECT_NE(error_of(artworks, stock, options).find("rotations"), std::string::npos);
  options = good, options.kerf = Millimetres(-1);
  EXPECT_NE(error_of(artworks, stock, options).find("kerf"), std::string::npos);

  std::vector<StockPanel> empty = stock;
  empty[0].free.pixels = cv::Mat(100, 100, CV_8UC1, cv::Scalar(0));
  EXPECT_NE(error_of(artworks, empty, good).find("free wood"), std::string::npos);
  std::vector<Artwork> dot = artworks;
  dot[0].picture = cv::Mat(1, 1, CV_8UC3, cv::Scalar(1, 2, 3));
  EXPECT_NE(error_of(dot, stock, good).find("1 x 1 pixels"), std::string::npos);
}

TEST(Plan, FreeWoodMayLieInAnotherRasterThanThePicture) {
  StockPanel panel = wood_panel("P", 100, 80, 50.8, 61);
  // Free: only x in [10, 30) mm and y in [5, 35) mm, as a coarse raster with its own origin.
  panel.free.pixels = cv::Mat(30, 20, CV_8UC1, cv::Scalar(255));
  panel.free.resolution = {1};
  panel.free.origin = point<PanelFrame>(10, 5);
  const Plan plan = planned({blob_artwork("A", 40, 40, 14_mm, 62)}, {panel}, small_options());
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement) continue;
    for (const auto& p : piece.panel_outline()) {
      EXPECT_GE(p.x.count(), 10.15);
      EXPECT_LE(p.x.count(), 29.85);
      EXPECT_GE(p.y.count(), 5.15);
      EXPECT_LE(p.y.count(), 34.85);
    }
  }
  EXPECT_EQ(unfilled(plan), 0U);
}

// Equation 4 of a whole picture, pixel by pixel, with the Sobel filter written out.
double cost_of_picture(const cv::Mat& preview, const Artwork& artwork, const std::vector<StockPanel>& stock,
                       const PlanOptions& options) {
  const cv::Mat grey = grey_of(preview);
  const cv::Mat before = grey_of(stretch(artwork.picture, preview.cols, preview.rows));
  GreyHistogram tones;
  for (const StockPanel& panel : stock) tones.add(grey_of(panel.picture.pixels), panel.free.pixels);
  const cv::Mat wanted = match_tones(before, tones, options.w_hist);
  const auto edge = [](const cv::Mat& map, int row, int column) {
    const auto at = [&](int r, int c) {
      const auto within = [](int i, int size) { return i < 0 ? -i : i >= size ? 2 * size - 2 - i : i; };
      return map.at<float>(within(r, map.rows), within(c, map.cols));
    };
    double x = 0, y = 0;
    for (const int k : {-1, 0, 1}) {
      const auto weight = static_cast<float>(2 - std::abs(k));
      x += weight * (at(row + k, column + 1) - at(row + k, column - 1));
      y += weight * (at(row + 1, column + k) - at(row - 1, column + k));
    }
    return 0.25 * std::hypot(x, y);
  };
  double sum = 0;
  for (int r = 0; r < grey.rows; ++r)
    for (int c = 0; c < grey.cols; ++c) {
      const double di = grey.at<float>(r, c) - wanted.at<float>(r, c), de = edge(grey, r, c) - edge(before, r, c);
      sum += options.w_intensity * options.w_intensity * di * di + options.w_edge * options.w_edge * de * de;
    }
  return sum;
}

TEST(Plan, NamesSquaresThatAreTooSmallToBeHandledAndPlansThem) {
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 91)};
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 5_mm, 92)};
  PlanOptions options = small_options();
  options.patch = 1.6667_mm, options.min_width = 1.5_mm, options.min_size = 0_mm;  // 2.8 mm2, where 4 are the least
  const Plan small = planned(artworks, stock, options);
  ASSERT_EQ(small.unfit.size(), 9U);
  EXPECT_EQ(small.unfit.front().mark, "A1-1");
  EXPECT_EQ(small.unfit.front().why, "is too small to be handled");
  EXPECT_EQ(unfilled(small), 0U);
  EXPECT_THAT(small.warnings, Contains(AllOf(HasSubstr("9 pieces"), HasSubstr("A1-1 is too small to be handled"),
                                             HasSubstr("and 1 more"), HasSubstr("choose larger patches"))));
  options.patch = 2.5_mm;
  const Plan large = planned(artworks, stock, options);
  EXPECT_TRUE(large.unfit.empty());
  EXPECT_THAT(large.warnings, Each(Not(HasSubstr("handled"))));
}

// The paper's lower bound, since smaller ones get lost.
TEST(Plan, NamesSquaresThatAreSmallerThanTheStatedSizeAndPlansThem) {
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 91)};
  const std::vector<Artwork> artworks{blob_artwork("A", 40, 40, 14.7_mm, 92)};
  PlanOptions options = small_options();
  options.patch = 4.9_mm, options.min_size = 5_mm;
  const Plan small = planned(artworks, stock, options);
  ASSERT_EQ(small.unfit.size(), 9U);
  EXPECT_EQ(unfilled(small), 0U);
  EXPECT_THAT(small.warnings, Contains(AllOf(HasSubstr("9 pieces are thinner than 1.5 mm or smaller than a square of "
                                                       "5 mm: A1-1 is too small to be handled"),
                                             HasSubstr("or a smaller --min-width-mm or --min-size-mm"))));
  options.min_size = 4.9_mm;
  EXPECT_TRUE(planned(artworks, stock, options).unfit.empty());
  options.min_size = 5_mm, options.patch = 7.35_mm;
  EXPECT_TRUE(planned(artworks, stock, options).unfit.empty());
}

// However they are laid out, where patches are larger than it.
TEST(Plan, LayoutsMakeNoPieceSmallerThanTheStatedSize) {
  const std::vector<StockPanel> stock{wood_panel("P", 220, 180, 50.8, 93)};
  const std::vector<Artwork> artworks{blob_artwork("A", 60, 60, 44_mm, 94)};
  for (const LayoutKind layout : {LayoutKind::kMosaic, LayoutKind::kSegmentation, LayoutKind::kMorph})
    for (const Refine refine : {Refine::kNone, Refine::kDp}) {
      PlanOptions options = small_options();
      options.patch = 8_mm, options.layout = layout, options.refine = refine, options.min_size = 5.5_mm;
      const Plan plan = planned(artworks, stock, options);
      for (const Piece& piece : plan.pieces)
        EXPECT_GE(signed_area(piece.artwork_outline), 5.5 * 5.5 - 0.01) << static_cast<int>(layout) << piece.mark;
      EXPECT_TRUE(plan.unfit.empty()) << static_cast<int>(layout) << static_cast<int>(refine);
    }
}

TEST(Preview, CostsWhatItsPixelsMeasureSeamsIncluded) {
  PlanOptions options = small_options();
  options.w_intensity = 0.7, options.w_edge = 0.4;
  const std::vector<StockPanel> stock{wood_panel("P", 110, 90, 50.8, 91)};
  const Artwork artwork = blob_artwork("A", 56, 42, 21_mm, 92);
  const Plan plan = planned({artwork}, stock, options);
  ASSERT_EQ(unfilled(plan), 0U);
  const auto preview = assemble_preview(plan, 0, stock, ScanResolution::from_dpi(options.dpi));
  const auto cost = preview_cost(plan, 0, *preview, options);
  ASSERT_TRUE(cost.ok()) << cost.error().message;
  const double expected = cost_of_picture(preview->pixels, artwork, stock, options);
  EXPECT_EQ(cost->pixels, preview->pixels.rows * preview->pixels.cols);
  EXPECT_NEAR(cost->total, expected, 1e-4 * expected);
  EXPECT_GT(cost->per_pixel().value(), cost_per_pixel(plan)) << "seams cost nothing";
  EXPECT_EQ(preview_cost(plan, 1, *preview, options).error().code, ErrorCode::kInvalidArgument);
}

TEST(Preview, ShowsTheWoodWhereItWillLieAndMagentaWhereThereIsNone) {
  const std::vector<StockPanel> stock{wood_panel("P", 60, 60, 50.8, 81)};
  PlanOptions options = small_options();
  options.rotations = 1;
  const Plan plan = planned({blob_artwork("A", 40, 40, 70_mm, 82)}, stock, options);
  const auto preview = assemble_preview(plan, 0, stock, ScanResolution::from_dpi(50.8));
  ASSERT_TRUE(preview.ok());
  EXPECT_EQ(preview->pixels.cols, 140);
  EXPECT_EQ(preview->pixels.rows, 140);
  for (const Piece& piece : plan.pieces) {
    const cv::Mat shown = preview->pixels(cv::Rect(piece.column * 14, piece.row * 14, 14, 14));
    if (!piece.placement) {
      EXPECT_EQ(cv::norm(shown, cv::Mat(14, 14, CV_8UC3, cv::Scalar(255, 0, 255)), cv::NORM_INF), 0);
      continue;
    }
    // One rotation: the wood is copied pixel by pixel.
    const Point<PanelFrame> corner = piece.panel_outline()[3];
    double column = 0, row = 0;
    stock[0].picture.to_pixels(corner, column, row);
    const cv::Rect from(static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row)), 14, 14);
    EXPECT_LE(cv::norm(shown, stock[0].picture.pixels(from), cv::NORM_INF), 1);
  }
  EXPECT_EQ(assemble_preview(plan, 0, {}, ScanResolution::from_dpi(50)).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(assemble_preview(plan, 1, stock, ScanResolution::from_dpi(50)).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace veneer::planner
