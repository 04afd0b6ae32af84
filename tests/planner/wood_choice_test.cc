// Which wood a plan may use, and by what it chooses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "planner/files/preview.h"
#include "planner/pictures/resample.h"
#include "planner/plan.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

// Patches of many hues, all of about the same brightness, with a little noise.
cv::Mat coloured(int columns, int rows, int cell, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat lab(rows, columns, CV_32FC3), bgr, out;
  for (int top = 0; top < rows; top += cell)
    for (int left = 0; left < columns; left += cell) {
      const double yellow = random.uniform(0.0, 40.0), red = random.uniform(-10.0, 30.0), light = random.gaussian(4);
      lab(cv::Rect(left, top, std::min(cell, columns - left), std::min(cell, rows - top)))
          .setTo(cv::Scalar(60 + light, red, yellow));
    }
  cv::cvtColor(lab, bgr, cv::COLOR_Lab2BGR);
  bgr.convertTo(out, CV_8UC3, 255);
  return out;
}

double mean_colour_difference(const cv::Mat& a, const cv::Mat& b) {
  const auto lab = [](const cv::Mat& bgr) {
    cv::Mat scaled, converted;
    bgr.convertTo(scaled, CV_32FC3, 1.0 / 255);
    cv::cvtColor(scaled, converted, cv::COLOR_BGR2Lab);
    return converted;
  };
  const cv::Mat x = lab(a), y = lab(b);
  double sum = 0;
  for (int r = 0; r < x.rows; ++r)
    for (int c = 0; c < x.cols; ++c) sum += cv::norm(x.at<cv::Vec3f>(r, c) - y.at<cv::Vec3f>(r, c));
  return sum / x.rows / x.cols;
}

TEST(WoodChoice, TheColourWeightLowersTheMeanColourDifference) {
  const ScanResolution resolution = ScanResolution::from_dpi(50.8);
  StockPanel panel = test::wood_panel("P", 200, 160, 50.8, 1);
  panel.picture.pixels = coloured(200, 160, 20, 2);
  Artwork artwork = test::blob_artwork("A", 60, 60, 30_mm, 3);
  artwork.picture = coloured(60, 60, 10, 4);
  PlanOptions options;
  options.patch = 5_mm, options.dpi = 50.8, options.rotations = 3, options.threads = 1;
  const auto difference = [&](double w_colour) {
    options.w_colour = w_colour;
    const auto plan = make_plan({&artwork, 1}, {&panel, 1}, options);
    EXPECT_TRUE(plan.ok());
    EXPECT_EQ(unfilled(*plan), 0U);
    const cv::Mat preview = assemble_preview(*plan, 0, {&panel, 1}, resolution)->pixels;
    return mean_colour_difference(preview, stretch(artwork.picture, preview.cols, preview.rows));
  };
  const double without = difference(0), some = difference(0.5), full = difference(1);
  EXPECT_LT(some, 0.8 * without);
  EXPECT_LT(full, 0.8 * without);
}

// Tan wood of all tones and some red of the middle ones: by tones alone grey pictures take the red too; once colours
// count and are mapped to the wood's they are made of the tan alone. By tones alone 20 pictures had 0 to 12 red pieces
// of 36, one of them none.
TEST(WoodChoice, APictureKeepsToOneFamilyOfWoods) {
  StockPanel panel = test::wood_panel("P", 240, 200, 50.8, 1);
  cv::Mat lab(200, 240, CV_32FC3), bgr;
  cv::RNG random(5);
  for (int r = 0; r < 200; ++r)
    for (int c = 0; c < 240; ++c) {
      const bool red = c >= 170;
      const double lightness = red ? 38 + 0.14 * r : 15 + 0.47 * c + random.gaussian(1);
      lab.at<cv::Vec3f>(r, c) =
          red ? cv::Vec3f(static_cast<float>(lightness), 42, 34) : cv::Vec3f(static_cast<float>(lightness), 8, 24);
    }
  cv::cvtColor(lab, bgr, cv::COLOR_Lab2BGR);
  bgr.convertTo(panel.picture.pixels, CV_8UC3, 255);
  PlanOptions options;
  options.patch = 5_mm, options.dpi = 50.8, options.rotations = 2, options.threads = 1, options.w_edge = 0.1;
  options.w_hist = 1, options.priority = Priority::kCentre;
  const auto red_pieces = [&] {
    std::ptrdiff_t count = 0;
    for (const std::uint64_t seed : {3U, 4U, 5U}) {
      const Artwork artwork = test::blob_artwork("A", 60, 60, 30_mm, seed);
      const auto plan = make_plan({&artwork, 1}, {&panel, 1}, options);
      EXPECT_TRUE(plan.ok());
      count += std::count_if(plan->pieces.begin(), plan->pieces.end(), [](const Piece& piece) {
        const Ring<PanelFrame> outline = piece.panel_outline();
        return bounds(outline).max.x.count() > 170 / 2.0 + 1;
      });
    }
    return count;
  };
  EXPECT_GT(red_pieces(), 3);
  options.w_colour = 0.5, options.w_gamut = 1;
  EXPECT_EQ(red_pieces(), 0);
}

TEST(WoodChoice, PanelsAreChosenByTheirMaterial) {
  std::vector<StockPanel> stock{test::wood_panel("P", 20, 20, 50.8, 1), test::wood_panel("Q", 20, 20, 50.8, 2),
                                test::wood_panel("R", 20, 20, 50.8, 3)};
  stock[0].material = "oak", stock[2].material = "walnut";
  EXPECT_EQ(only_materials(stock, {})->size(), 3U);
  const std::vector<std::string> oak{"oak"}, elm{"elm"};
  const auto chosen = only_materials(stock, oak);
  ASSERT_TRUE(chosen.ok());
  ASSERT_EQ(chosen->size(), 1U);
  EXPECT_EQ(chosen->front().id.value, "P");
  EXPECT_EQ(only_materials(stock, elm).error().message, "no panel is elm: choose from oak, walnut");
  EXPECT_TRUE(weigh_tones(stock, "walnut", 2.5).ok());
  EXPECT_EQ(stock[2].tone_weight, 2.5);
  EXPECT_EQ(stock[1].tone_weight, 1);
  EXPECT_FALSE(weigh_tones(stock, "elm", 1).ok());
  EXPECT_FALSE(weigh_tones(stock, "oak", std::nan("")).ok());
}

// A dark and a pale panel; a plain picture in between goes where the weights pull its tones.
TEST(WoodChoice, ToneWeightsPullThePictureTowardsAWood) {
  std::vector<StockPanel> stock{test::wood_panel("dark", 80, 80, 50.8, 1), test::wood_panel("pale", 80, 80, 50.8, 2)};
  stock[0].picture.pixels.setTo(cv::Scalar::all(60)), stock[1].picture.pixels.setTo(cv::Scalar::all(190));
  stock[0].material = "dark", stock[1].material = "pale";
  Artwork artwork = test::blob_artwork("A", 60, 60, 15_mm, 3);
  cv::randu(artwork.picture, 100, 150);
  cv::GaussianBlur(artwork.picture, artwork.picture, {}, 3);
  PlanOptions options;
  options.patch = 3_mm, options.dpi = 50.8, options.rotations = 1, options.threads = 1;
  options.w_edge = 0, options.w_hist = 1;
  const auto dark_pieces = [&] {
    const auto plan = make_plan({&artwork, 1}, stock, options);
    EXPECT_TRUE(plan.ok());
    return std::count_if(plan->pieces.begin(), plan->pieces.end(),
                         [](const Piece& piece) { return piece.placement && piece.placement->panel.value == "dark"; });
  };
  const auto even = dark_pieces();
  ASSERT_TRUE(weigh_tones(stock, "dark", 0).ok());
  EXPECT_EQ(dark_pieces(), 0);
  ASSERT_TRUE(weigh_tones(stock, "dark", 10).ok());
  EXPECT_GT(dark_pieces(), even);
}

// One panel, dark on the left and pale on the right. Where outlines reach into each other the least weight counts.
TEST(WoodChoice, ToneWeightsAreThoseOfAPanelsZones) {
  std::vector<StockPanel> stock{test::wood_panel("P", 160, 80, 50.8, 1)};
  stock[0].picture.pixels.setTo(cv::Scalar::all(190));
  stock[0].picture.pixels.colRange(0, 80).setTo(cv::Scalar::all(60));
  const auto zone = [](const char* material, double left, double right) {
    return WoodZone{material,
                    {point<PanelFrame>(left, 0), point<PanelFrame>(right, 0), point<PanelFrame>(right, 40),
                     point<PanelFrame>(left, 40)}};
  };
  stock[0].zones = {zone("walnut", 0, 40), zone("maple", 20, 80)};
  Artwork artwork = test::blob_artwork("A", 60, 60, 15_mm, 3);
  cv::randu(artwork.picture, 100, 150);
  cv::GaussianBlur(artwork.picture, artwork.picture, {}, 3);
  PlanOptions options;
  options.patch = 3_mm, options.dpi = 50.8, options.rotations = 1, options.threads = 1;
  options.w_edge = 0, options.w_hist = 1;
  const auto dark_pieces = [&] {
    const auto plan = make_plan({&artwork, 1}, stock, options);
    EXPECT_TRUE(plan.ok());
    return std::count_if(plan->pieces.begin(), plan->pieces.end(), [](const Piece& piece) {
      return piece.placement && bounds(piece.panel_outline()).min.x.count() < 39;
    });
  };
  const auto even = dark_pieces();
  EXPECT_GT(even, 0);
  for (const bool first : {true, false}) {
    if (!first) std::swap(stock[0].zones[0], stock[0].zones[1]);
    ASSERT_TRUE(weigh_tones(stock, "walnut", 0).ok());
    EXPECT_EQ(dark_pieces(), 0) << "the dark wood under both outlines has no weight either";
    ASSERT_TRUE(weigh_tones(stock, "walnut", 10).ok());
    EXPECT_GT(dark_pieces(), even);
  }
  EXPECT_EQ(weigh_tones(stock, "elm", 1).error().message, "no panel is elm: choose from maple, walnut");
}

TEST(WoodChoice, APictureWithoutDetailIsWarnedOf) {
  const std::vector<StockPanel> stock{test::wood_panel("P", 150, 150, 50.8, 1)};
  Artwork artwork = test::blob_artwork("A", 60, 60, 20_mm, 3);
  cv::randu(artwork.picture, 0, 255);
  PlanOptions options;
  options.patch = 5_mm, options.dpi = 50.8, options.rotations = 1, options.threads = 1;
  const auto warnings = [&] { return make_plan({&artwork, 1}, stock, options)->warnings; };
  EXPECT_TRUE(warnings().empty());
  cv::GaussianBlur(artwork.picture, artwork.picture, {}, 8);
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_THAT(warnings()[0], HasSubstr("hardly any detail at 50.8 dpi"));
  options.w_edge = 0;
  EXPECT_TRUE(warnings().empty());
  options.w_edge = 0.5;
  artwork.picture.setTo(cv::Scalar::all(128));
  ASSERT_EQ(warnings().size(), 1U);
  EXPECT_THAT(warnings()[0], HasSubstr("is one plain tone"));
}

}  // namespace
}  // namespace veneer::planner
