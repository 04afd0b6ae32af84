#include "planner/suggest/suggestions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "planner/problem/priority.h"
#include "planner/suggest/contact_sheet.h"
#include "planner/suggest/crops.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using ::testing::HasSubstr;

TEST(Crops, LieWithinEachOtherAroundWhatIsSalient) {
  cv::Mat saliency(60, 90, CV_32FC1, cv::Scalar(0.1));
  cv::circle(saliency, {70, 20}, 8, cv::Scalar(1), cv::FILLED);
  const std::vector<cv::Rect> crops = crops_of({900, 600}, saliency);
  ASSERT_EQ(crops.size(), 3U);
  EXPECT_EQ(crops[0], cv::Rect(0, 0, 900, 600));
  for (std::size_t i = 1; i < crops.size(); ++i) {
    EXPECT_EQ(crops[i] & crops[i - 1], crops[i]);
    EXPECT_NEAR(static_cast<double>(crops[i].width) / crops[i].height, 1.5, 0.02);
    EXPECT_TRUE(crops[i].contains({700, 200}));
  }
  EXPECT_EQ(crops_of({20, 20}, saliency).size(), 1U);
}

TEST(Crops, TakeThePartOfEveryPicture) {
  Artwork artwork = test::blob_artwork("A", 60, 40, Millimetres(20), 1);
  artwork.importance = cv::Mat(20, 30, CV_8UC1, cv::Scalar(0));
  artwork.importance(cv::Rect(15, 0, 15, 20)).setTo(255);
  crop_pictures(artwork, {30, 10, 20, 20});
  EXPECT_EQ(artwork.picture.size(), cv::Size(20, 20));
  EXPECT_EQ(artwork.importance.size(), cv::Size(10, 10));
  EXPECT_EQ(cv::countNonZero(artwork.importance), 100);
}

// A brush's mask has some dozen cells; a crop's sides lie within them.
TEST(Crops, PartTheCellsOfACoarseMaskWhereTheyLie) {
  Artwork artwork = test::blob_artwork("A", 60, 40, Millimetres(20), 1);
  artwork.importance = cv::Mat(1, 3, CV_8UC1);
  for (int i = 0; i < 3; ++i) artwork.importance.at<unsigned char>(0, i) = static_cast<unsigned char>(1 + i);
  crop_pictures(artwork, {15, 0, 30, 40});
  const auto share = [&](int cell) {
    return static_cast<double>(cv::countNonZero(artwork.importance == cell)) /
           static_cast<double>(artwork.importance.total());
  };
  EXPECT_NEAR(share(1), 5.0 / 30, 0.02);
  EXPECT_NEAR(share(2), 20.0 / 30, 0.02);
  EXPECT_NEAR(share(3), 5.0 / 30, 0.02);
  EXPECT_LE(artwork.importance.cols, 30) << "no finer than the picture";
}

// Whatever sides of its cells a crop parts: sizes of a mosaic's cells must have the picture's shape.
TEST(Crops, LeaveAMaskOfTheirShape) {
  for (const cv::Rect& crop : {cv::Rect{100, 0, 720, 900}, cv::Rect{0, 10, 1200, 500}, cv::Rect{50, 50, 600, 450},
                               cv::Rect{101, 203, 99, 690}, cv::Rect{3, 3, 1, 1}}) {
    Artwork artwork;
    artwork.picture = cv::Mat(900, 1200, CV_8UC3, cv::Scalar::all(0));
    artwork.guides.cell_sizes = cv::Mat(36, 48, CV_8UC1, cv::Scalar(0));
    crop_pictures(artwork, crop);
    const Status good = check_cell_sizes(artwork.guides.cell_sizes, artwork.picture.size(), "it");
    EXPECT_TRUE(good.ok()) << good.error().message;
    EXPECT_LE(artwork.guides.cell_sizes.cols, crop.width);
  }
  Artwork tall;
  tall.picture = cv::Mat(4000, 400, CV_8UC3, cv::Scalar::all(0));
  tall.guides.cell_sizes = cv::Mat(48, 5, CV_8UC1, cv::Scalar(0));
  tall.importance = cv::Mat(2, 3000, CV_8UC1, cv::Scalar(0));
  crop_pictures(tall, {1, 1, 399, 3999});
  const Status good = check_cell_sizes(tall.guides.cell_sizes, tall.picture.size(), "it");
  EXPECT_TRUE(good.ok()) << good.error().message;
  EXPECT_LE(tall.importance.total(), std::size_t{3000} * 4000) << "strips stay strips";
}

TEST(Crops, KeepFlowLinesWithinWhatCanBeDrawn) {
  Artwork artwork;
  artwork.picture = cv::Mat(900, 30000, CV_8UC3, cv::Scalar::all(0));
  artwork.guides.flow_lines = {{{100000, 5000}, {-100000, 5000}}};
  crop_pictures(artwork, {29999, 0, 1, 900});
  ASSERT_EQ(artwork.guides.flow_lines.size(), 1U);
  EXPECT_GT(artwork.guides.flow_lines[0][0].x, kWholeSide);
  EXPECT_LT(artwork.guides.flow_lines[0][1].x, 0);
  EXPECT_EQ(artwork.guides.flow_lines[0][0].y, 5000);
}

TEST(Crops, AreWrittenAsTheyAreRead) {
  EXPECT_EQ(*crop_of("3,4,50,60"), cv::Rect(3, 4, 50, 60));
  EXPECT_EQ(crop_text({3, 4, 50, 60}), "3,4,50,60");
  for (const char* text : {"", "1,2,3", "1,2,3,", "1,2,3,4,5", "1,2,x,4", "1.5,2,3,4", "99999999999,0,10,10"})
    EXPECT_EQ(crop_of(text).error().code, ErrorCode::kInvalidArgument) << text;
  EXPECT_TRUE(crop_of("10,0,20,30", {30, 30}, "it").ok());
  for (const char* text : {"11,0,20,30", "-1,0,20,20", "0,0,0,5", "2147483647,0,2,2"})
    EXPECT_THAT(crop_of(text, {30, 30}, "it").error().message, HasSubstr("does not lie within \"it\"")) << text;
}

TEST(Likeness, FallsFromOneAsPiecesGetCoarser) {
  const cv::Mat picture = test::blob_artwork("A", 128, 128, Millimetres(20), 5).picture;
  double before = likeness(picture, picture);
  EXPECT_NEAR(before, 1, 1e-6);
  for (const int across : {32, 16, 8, 4}) {
    cv::Mat coarse, squares;
    cv::resize(picture, coarse, {across, across}, 0, 0, cv::INTER_AREA);
    cv::resize(coarse, squares, picture.size(), 0, 0, cv::INTER_NEAREST);
    const double now = likeness(squares, picture);
    EXPECT_LT(now, before) << across;
    before = now;
  }
  cv::Mat noise(128, 128, CV_8UC3);
  cv::theRNG().state = 7;
  cv::randu(noise, 0, 255);
  EXPECT_LT(likeness(noise, picture), 0.3);
  EXPECT_EQ(likeness(cv::Mat(128, 128, CV_8UC3, cv::Scalar::all(90)), picture), 0);
}

AdviceLimits limits(double size_mm) {
  AdviceLimits out;
  out.size = Millimetres(size_mm), out.smallest = Millimetres(4);
  return out;
}

TEST(Advice, EverySuggestionIsAPlanThatTheWoodSufficesFor) {
  const StockPanel panel = test::wood_panel("P", 240, 200, 50.8, 3);  // 120 x 100 mm
  const Artwork artwork = test::blob_artwork("A", 60, 40, Millimetres(20), 4);
  const auto advice = advise(artwork, {&panel, 1}, test::small_options_without_saliency(), limits(40));
  ASSERT_TRUE(advice.ok()) << advice.error().message;
  ASSERT_TRUE(advice->best);
  EXPECT_TRUE(advice->remarks.empty());
  std::size_t whole = 0;
  for (const Suggestion& it : advice->suggestions) {
    EXPECT_EQ(it.unfilled, 0U);
    EXPECT_GT(it.pieces, 8U);
    EXPECT_GE(it.patch, Millimetres(4));
    EXPECT_LE(std::min(it.width, it.height), Millimetres(40));
    EXPECT_GT(it.cutting.count(), static_cast<double>(it.pieces));
    EXPECT_GT(it.likeness, 0.2);
    EXPECT_FALSE(it.preview.empty());
    whole += it.crop.size() == artwork.picture.size() ? 1 : 0;
  }
  EXPECT_GT(advice->suggestions.size(), whole);
  // Cells take most of the time, so they are tried where squares read best.
  const Suggestion *clearest = nullptr, *cells = nullptr;
  for (const Suggestion& it : advice->suggestions) {
    const bool is_cells = it.layout == LayoutKind::kMosaic;
    if (is_cells) {
      EXPECT_EQ(cells, nullptr);
      cells = &it;
    } else if (clearest == nullptr || it.likeness > clearest->likeness) {
      clearest = &it;
    }
  }
  ASSERT_TRUE(clearest != nullptr && cells != nullptr);
  EXPECT_EQ(cells->crop, clearest->crop);
  // Few or many squares across this picture would both be 4 mm, the smallest allowed, so they are one suggestion. Cells
  // are another, which may be of the whole picture too.
  EXPECT_EQ(whole, cells->crop.size() == artwork.picture.size() ? 2U : 1U);
  // No other that reads as well is quicker to cut.
  const Suggestion& best = advice->suggestions[*advice->best];
  for (const Suggestion& it : advice->suggestions)
    EXPECT_FALSE(it.likeness >= best.likeness && it.cutting < best.cutting);
  const cv::Mat sheet = contact_sheet(*advice, artwork.picture);
  EXPECT_GT(sheet.cols, 4 * sheet.rows / 5);
  EXPECT_EQ(sheet.type(), CV_8UC3);
}

TEST(Advice, WhereWoodIsShortTheFirstRemedyIsASmallerPicture) {
  const StockPanel panel = test::wood_panel("P", 120, 100, 50.8, 3);  // 60 x 50 mm
  const Artwork artwork = test::blob_artwork("A", 60, 60, Millimetres(20), 4);
  AdviceLimits wanted = limits(200);
  wanted.crops = false;
  const auto advice = advise(artwork, {&panel, 1}, test::small_options_without_saliency(), wanted);
  ASSERT_TRUE(advice.ok()) << advice.error().message;
  ASSERT_TRUE(advice->best);
  for (const Suggestion& it : advice->suggestions) EXPECT_LT(it.width, Millimetres(50));
  ASSERT_EQ(advice->remarks.size(), 1U);
  EXPECT_THAT(advice->remarks[0], HasSubstr("does not suffice for 200 mm: make the picture smaller, at most about"));
  EXPECT_THAT(advice->remarks[0], HasSubstr("or add a panel"));
}

TEST(Advice, LargePatchesAreLookedAtAsCoarselyAsAPlanCanBe) {
  const StockPanel panel = test::wood_panel("P", 120, 100, 12.7, 3);  // 240 x 200 mm
  const Artwork artwork = test::blob_artwork("A", 40, 40, Millimetres(20), 4);
  AdviceLimits wanted = limits(90);
  wanted.smallest = Millimetres(24), wanted.crops = false;
  const auto advice = advise(artwork, {&panel, 1}, test::small_options_without_saliency(), wanted);
  ASSERT_TRUE(advice.ok()) << advice.error().message;
  ASSERT_FALSE(advice->suggestions.empty());
  for (const Suggestion& it : advice->suggestions) EXPECT_EQ(it.dpi, 10);
}

TEST(Advice, AStopRequestEndsIt) {
  const StockPanel panel = test::wood_panel("P", 120, 100, 50.8, 3);
  const Artwork artwork = test::blob_artwork("A", 60, 60, Millimetres(20), 4);
  std::stop_source stop;
  const auto advice = advise(
      artwork, {&panel, 1}, test::small_options_without_saliency(), limits(30),
      [&](double, std::string_view) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(advice.ok());
  EXPECT_EQ(advice.error().code, ErrorCode::kCancelled);
}

TEST(ContactSheet, SaysDurationsAsPeopleDo) {
  EXPECT_EQ(duration_text(std::chrono::seconds(20)), "1 min");
  EXPECT_EQ(duration_text(std::chrono::minutes(52)), "52 min");
  EXPECT_EQ(duration_text(std::chrono::minutes(70)), "1 h 10 min");
}

}  // namespace
}  // namespace veneer::planner
