// The same picture again and again.
#include "planner/series/series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "planner/files/plan_files.h"
#include "tests/support/small_plans.h"
#include "tests/support/synthetic_wood.h"

namespace veneer::planner {
namespace {

using test::blob_artwork;
using test::one_rotation_options;
using test::wood_panel;
using ::testing::HasSubstr;

class SeriesOfPictures : public ::testing::Test {
 protected:
  // Room for four pictures and a bit.
  const std::vector<StockPanel> stock_{wood_panel("P", 104, 100, 50.8, 3)};
  const Artwork artwork_ = blob_artwork("Z", 40, 40, 20_mm, 4);
};

TEST_F(SeriesOfPictures, EndsWithTheFirstPictureThatStaysIncomplete) {
  std::vector<double> fractions;
  const auto series = make_series(artwork_, stock_, one_rotation_options(), {},
                                  [&](double fraction, std::string_view) { fractions.push_back(fraction); });
  ASSERT_TRUE(series.ok()) << series.error().message;
  const auto columns = columns_of(*series);
  ASSERT_GE(columns.size(), 3U);
  ASSERT_EQ(series->sequential.artworks.size(), columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    EXPECT_EQ(columns[k].sequential.unfilled_last > 0, k + 1 == columns.size()) << k;
    EXPECT_EQ(series->interleaved[k].artworks.size(), k + 1);
    EXPECT_EQ(columns[k].interleaved.unfilled, unfilled(series->interleaved[k]));
    EXPECT_DOUBLE_EQ(columns[k].interleaved.mean, cost_per_pixel(series->interleaved[k]));
  }
  EXPECT_DOUBLE_EQ(columns.back().sequential.mean, cost_per_pixel(series->sequential));
  // Wood becomes worse from picture to picture.
  EXPECT_GT(*columns[columns.size() - 2].sequential.last, *columns.front().sequential.last);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_DOUBLE_EQ(fractions.back(), 1);
}

TEST_F(SeriesOfPictures, ConsistsOfThePlansThatMakePlanMakes) {
  SeriesOptions how;
  how.pictures = 2, how.sequential = how.interleaved = Priority::kSaliency;
  const auto series = make_series(artwork_, stock_, one_rotation_options(), how);
  ASSERT_TRUE(series.ok());
  PlanOptions options = one_rotation_options();
  std::vector<Artwork> artworks{artwork_, artwork_};
  artworks[0].letter = "A", artworks[1].letter = "B";
  EXPECT_EQ(plan_to_json(series->sequential), plan_to_json(*make_plan(artworks, stock_, options)));
  options.interleave = true;
  EXPECT_EQ(plan_to_json(series->interleaved[1]), plan_to_json(*make_plan(artworks, stock_, options)));
  // One picture is one picture, in turn or not.
  const auto columns = columns_of(*series);
  EXPECT_EQ(columns[0].sequential.last, columns[0].interleaved.last);
}

TEST_F(SeriesOfPictures, RefusesWhatWouldMixItsPicturesOrIsNotKept) {
  const auto refusal = [&](void (*change)(PlanOptions&)) {
    PlanOptions options = one_rotation_options();
    change(options);
    const auto series = make_series(artwork_, stock_, options, {1});
    EXPECT_FALSE(series.ok());
    return series.ok() ? "" : series.error().message;
  };
  for (void (*change)(PlanOptions&) :
       {+[](PlanOptions& o) { o.optimize = Optimize::kGlobal; }, +[](PlanOptions& o) { o.optimize_seconds = 1; },
        +[](PlanOptions& o) { o.optimize_iterations = 9; }})
    EXPECT_THAT(refusal(change), HasSubstr("leave --optimize out"));
  EXPECT_THAT(refusal([](PlanOptions& o) { o.alternatives = 3; }), HasSubstr("leave --alternatives out"));
}

TEST_F(SeriesOfPictures, IsWrittenAsFiguresCurveAndStrip) {
  SeriesOptions how;
  how.pictures = 2;
  const auto series = make_series(artwork_, stock_, one_rotation_options(), how);
  ASSERT_TRUE(series.ok());
  const auto columns = columns_of(*series);
  const auto json = nlohmann::json::parse(series_to_json(*series));
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["pieces_per_picture"], 16);
  ASSERT_EQ(json["columns"].size(), 2U);
  EXPECT_EQ(json["columns"][1]["pictures"], 2);
  EXPECT_EQ(json["columns"][1]["sequential"]["cost_per_pixel"], *columns[1].sequential.last);
  EXPECT_EQ(json["columns"][1]["interleaved"]["cost_per_pixel_of_all"], columns[1].interleaved.mean);

  pugi::xml_document chart;
  ASSERT_TRUE(chart.load_string(series_chart(columns).c_str()));
  EXPECT_EQ(chart.select_nodes("//*[name()='circle']").size(), 4U);  // two rows of two pictures
  // A higher cost stands higher.
  const auto height_of = [&](int circle) {
    return -std::stod(chart.select_nodes("//*[name()='circle']")[circle].node().attribute("cy").value());
  };
  EXPECT_EQ(columns[1].sequential.last > columns[0].sequential.last, height_of(1) > height_of(0));

  const auto strip = series_strip(*series, stock_, 30);
  ASSERT_TRUE(strip.ok());
  EXPECT_EQ(strip->cols, 2 * 30 + 3 * 8);
  EXPECT_EQ(strip->rows, 2 * 30 + 3 * 8);
  EXPECT_FALSE(series_strip(*series, {}, 30).ok());
}

TEST_F(SeriesOfPictures, HasNoCostForAPictureWithoutWood) {
  SeriesOptions how;
  how.pictures = 3;
  Artwork large = artwork_;
  large.width = large.height = 45_mm;
  const auto series = make_series(large, stock_, one_rotation_options(), how);
  ASSERT_TRUE(series.ok());
  const auto columns = columns_of(*series);
  EXPECT_FALSE(columns[2].sequential.last);
  EXPECT_EQ(columns[2].sequential.unfilled_last, 81U);
  EXPECT_TRUE(nlohmann::json::parse(series_to_json(*series))["columns"][2]["sequential"]["cost_per_pixel"].is_null());
  pugi::xml_document chart;
  ASSERT_TRUE(chart.load_string(series_chart(columns).c_str()));
  EXPECT_LT(chart.select_nodes("//*[name()='circle']").size(), 6U);
}

TEST_F(SeriesOfPictures, RefusesWhatItCannotDraw) {
  SeriesOptions how;
  how.pictures = kMostPictures + 1;
  const auto series = make_series(artwork_, stock_, one_rotation_options(), how);
  ASSERT_FALSE(series.ok());
  EXPECT_THAT(series.error().message, HasSubstr("at most 26 pictures"));
  EXPECT_FALSE(make_series(artwork_, {}, one_rotation_options(), {}).ok());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(make_series(artwork_, stock_, one_rotation_options(), {}, {}, stop.get_token()).error().code,
            ErrorCode::kCancelled);
}

}  // namespace
}  // namespace veneer::planner
