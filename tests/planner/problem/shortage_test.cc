// What a plan says when wood runs out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "planner/files/plan_report.h"
#include "planner/plan.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// A picture whose left half is black and whose right half is white.
Artwork black_and_white(Millimetres side) {
  Artwork artwork = test::blob_artwork("A", 60, 60, side, 1);
  artwork.picture.setTo(cv::Scalar::all(255));
  artwork.picture(cv::Rect(0, 0, 30, 60)).setTo(cv::Scalar::all(0));
  return artwork;
}

PlanOptions options() {
  PlanOptions out;
  out.patch = 10_mm, out.dpi = 50.8, out.rotations = 1, out.threads = 1, out.w_hist = 0, out.w_edge = 0;
  out.priority = Priority::kCentre;
  return out;
}

StockPanel clear_panel(int columns, int rows) {
  StockPanel panel = test::wood_panel("P", columns, rows, 50.8, 2);
  panel.free.pixels.setTo(255);
  return panel;
}

Plan planned(const Artwork& artwork, const StockPanel& panel, const PlanOptions& how) {
  return test::planned({artwork}, {panel}, how);
}

TEST(Shortage, IsNotReportedWhenAllIsWell) {
  const Plan plan = planned(black_and_white(20_mm), clear_panel(200, 200), options());
  EXPECT_FALSE(plan.shortage);
  EXPECT_TRUE(nlohmann::json::parse(report_to_json(plan, {}, 1, 1))["shortage"].is_null());
}

TEST(Shortage, NamesTheAreaAndTheTonesThatAreMissing) {
  // Room for one patch of 10 mm, and beside it a strip of 6 mm.
  const Plan plan = planned(black_and_white(20_mm), clear_panel(34, 22), options());
  ASSERT_TRUE(plan.shortage);
  EXPECT_EQ(plan.shortage->unfilled, 3U);
  EXPECT_EQ(unfilled(plan), 3U);
  EXPECT_NEAR(plan.shortage->area.count(), 300, 1e-6);
  const auto& missing = plan.shortage->missing;
  double sum = 0;
  for (const auto& band : missing) sum += band.count();
  EXPECT_NEAR(sum, 300, 1e-6);
  // One or two of the four patches are black, the others white; nothing lies in between.
  EXPECT_NEAR(missing.front().count() + missing.back().count(), 300, 1e-6);
  EXPECT_GE(missing.front().count(), 99.0);
  EXPECT_GE(missing.back().count(), 99.0);
  ASSERT_EQ(plan.warnings.size(), 1U);
  EXPECT_THAT(plan.warnings[0], HasSubstr("no free wood was left for 3 of 4 patches"));
  EXPECT_THAT(plan.warnings[0], HasSubstr("mm2 dark"));
  // A quarter of the area has wood: half the size.
  EXPECT_THAT(plan.warnings[0], HasSubstr(": make the picture about 50 % smaller, add a panel"));
}

// What `plan` leaves of the panel's free wood, as a fine raster: what its pieces touch with their kerf is gone.
StockPanel left_by(const Plan& plan, const StockPanel& panel) {
  constexpr int kFiner = 8;
  StockPanel left = panel;
  cv::resize(panel.free.pixels, left.free.pixels, {}, kFiner, kFiner, cv::INTER_NEAREST);
  left.free.resolution = {panel.free.resolution.px_per_mm * kFiner};
  for (const Piece& piece : plan.pieces) {
    if (!piece.placement) continue;
    const Box<PanelFrame> box = bounds(piece.panel_outline());  // pieces are upright here
    double c0 = 0, r0 = 0, c1 = 0, r1 = 0;
    left.free.to_pixels({box.min.x - plan.kerf, box.max.y + plan.kerf}, c0, r0);
    left.free.to_pixels({box.max.x + plan.kerf, box.min.y - plan.kerf}, c1, r1);
    const cv::Rect taken(cv::Point(cvFloor(c0), cvFloor(r0)), cv::Point(cvCeil(c1), cvCeil(r1)));
    left.free.pixels(taken & cv::Rect({0, 0}, left.free.pixels.size())).setTo(0);
  }
  return left;
}

struct Scarce {
  const char* name;
  Millimetres side;   // of the picture
  int columns, rows;  // of the panel
  int holes;
};

class ScarceWood : public ::testing::TestWithParam<Scarce> {};

TEST_P(ScarceWood, OffersSmallerPatchesThatReallyFit) {
  const Artwork artwork = black_and_white(GetParam().side);
  StockPanel panel = clear_panel(GetParam().columns, GetParam().rows);
  cv::RNG random(7);
  for (int i = 0; i < GetParam().holes; ++i) {
    const int radius = random.uniform(1, 6);
    const cv::Point middle{random.uniform(0, panel.free.pixels.cols), random.uniform(0, panel.free.pixels.rows)};
    cv::circle(panel.free.pixels, middle, radius, cv::Scalar(0), cv::FILLED);
  }
  const Plan plan = planned(artwork, panel, options());
  ASSERT_TRUE(plan.shortage && plan.shortage->smaller);
  const auto smaller = *plan.shortage->smaller;
  EXPECT_LT(smaller.side, 10_mm);
  // As many patches of that side as promised, on the wood that is left: all of them have their place.
  Artwork rest = artwork;
  rest.width = smaller.side * static_cast<double>(smaller.count), rest.height = smaller.side;
  PlanOptions small = options();
  small.patch = smaller.side, small.dpi *= 4;
  small.optimize = Optimize::kGlobal, small.optimize_iterations = 1;  // it packs where greedy would waste wood
  const Plan packed = planned(rest, left_by(plan, panel), small);
  ASSERT_EQ(packed.pieces.size(), smaller.count);
  EXPECT_EQ(unfilled(packed), 0U) << smaller.count << " of " << smaller.side.count() << " mm";
}

INSTANTIATE_TEST_SUITE_P(OfManyShapes, ScarceWood,
                         ::testing::Values(Scarce{"Strip", 20_mm, 34, 22, 0}, Scarce{"TwoStrips", 40_mm, 78, 60, 0},
                                           Scarce{"Knots", 60_mm, 110, 90, 14}),
                         [](const auto& scarce) { return std::string(scarce.param.name); });

TEST(Shortage, OffersSmallerPatchesThanThePictureWhenItIsASinglePatch) {
  StockPanel strips = clear_panel(60, 60);
  for (int r = 0; r < 60; r += 20) strips.free.pixels.row(r).setTo(0);  // strips of 9.5 mm
  PlanOptions how = options();
  how.patch = 100_mm;
  const Plan plan = planned(black_and_white(20_mm), strips, how);
  ASSERT_TRUE(plan.shortage && plan.shortage->smaller);
  EXPECT_LT(plan.shortage->smaller->side, 9.5_mm);
}

TEST(Shortage, SaysSoWhenNothingFitsAnyMore) {
  // 11 mm: one patch with its kerf, and a rim that is good for nothing.
  const Plan plan = planned(black_and_white(20_mm), clear_panel(22, 22), options());
  ASSERT_TRUE(plan.shortage);
  EXPECT_FALSE(plan.shortage->smaller);
  EXPECT_THAT(plan.warnings[0], HasSubstr("not even small patches fit"));
  const auto report = nlohmann::json::parse(report_to_json(plan, {}, 1, 1));
  EXPECT_EQ(report["shortage"]["unfilled"], 3);
  EXPECT_EQ(report["shortage"]["missing"].size(), 8U);
  EXPECT_TRUE(report["shortage"]["smaller"].is_null());
}

// Two pictures, dark all over but for what matters least; a panel with dark wood for one of them. What is salient in
// the second picture gets some of it only when it is reserved.
TEST(Shortage, DarkWoodIsReservedForWhatIsSalientInTheNextPicture) {
  StockPanel panel = clear_panel(120, 60);
  panel.picture.pixels.setTo(cv::Scalar::all(220));
  panel.picture.pixels(cv::Rect(0, 0, 36, 60)).setTo(cv::Scalar::all(20));
  std::vector<Artwork> artworks;
  for (const char* letter : {"A", "B"}) {
    Artwork& artwork = artworks.emplace_back(test::blob_artwork(letter, 60, 60, 24_mm, 1));
    artwork.letter = letter;
    cv::randu(artwork.picture, 10, 30);  // something to be salient
    artwork.importance = cv::Mat(60, 60, CV_8UC1, cv::Scalar(1));
    artwork.importance(cv::Rect(0, 0, 30, 30)).setTo(255);  // the upper left quarter
  }
  PlanOptions how = options();
  how.patch = 6_mm, how.priority = Priority::kSaliency;
  const auto cost_of_what_matters = [&](double reserve) {
    how.reserve = reserve;
    const auto plan = make_plan(artworks, {&panel, 1}, how);
    double cost = 0;
    for (const Piece& piece : plan->pieces)
      if (piece.artwork == 1 && piece.row < 2 && piece.column < 2) cost += piece.cost;
    return cost;
  };
  EXPECT_LT(cost_of_what_matters(0.25), 0.02 * cost_of_what_matters(0));
}

}  // namespace
}  // namespace veneer::planner
