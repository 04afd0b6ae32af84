// What is left of panels, through the API: now, as it was booked, and as a picture.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "base/polygon_ops.h"
#include "cli/render.h"
#include "planner/pictures/pictures.h"
#include "tests/daemon/routes/panel_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::panel_square;

class PanelRemnants : public PanelCell {};

TEST_F(PanelRemnants, TellsWhatIsLeftOfAPanel) {
  until_what_is_left_is_booked("P-0002");
  change([](Repositories& r) {
    // The left third is walnut, nobody has said what the rest is of.
    return r.materials.add_zones(
        {"P-0002"}, {{1, Region<PanelFrame>(strip(0, 10)), "walnut"}, {2, Region<PanelFrame>(strip(10, 30)), ""}});
  });
  const json fresh = get("/panels/P-0002")["remnant"];
  ASSERT_EQ(fresh["woods"].size(), 2U) << fresh.dump();
  EXPECT_TRUE(fresh["woods"][0]["material"].is_null());
  EXPECT_EQ(fresh["woods"][1]["material"], "walnut");
  EXPECT_NEAR(fresh["woods"][1]["free_mm2"].get<double>(), 200, 6);
  EXPECT_LE(fresh["woods"][1]["free_mm2"].get<double>(), 204) << "the mask is a little larger than its panel";
  EXPECT_NEAR(fresh["square"]["side_mm"].get<double>(), 20.3, 0.05);
  EXPECT_NEAR(fresh["circle"]["diameter_mm"].get<double>(), 20.3, 0.05);
  EXPECT_EQ(get("/panels/P-0002")["remnant"], fresh);

  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(12, 2, 6)), "a knot", kThen);
  });
  const json left = get("/panels/P-0002");
  // On the right of the knot, or on its left, are 12 mm.
  EXPECT_NEAR(left["remnant"]["square"]["side_mm"].get<double>(), 12.3, 0.2) << left["remnant"].dump();
  EXPECT_NEAR(left["remnant"]["circle"]["diameter_mm"].get<double>(), 14.9, 1.0) << left["remnant"].dump();
  EXPECT_NEAR(left["remnant"]["woods"][0]["free_mm2"].get<double>(), fresh["woods"][0]["free_mm2"].get<double>() - 36,
              5);
  EXPECT_EQ(left["remnant"]["woods"][1], fresh["woods"][1]);
  EXPECT_THAT(cli::render_panel(left), HasSubstr("wood nobody has named 4 cm2, walnut 2 cm2\n"));
  EXPECT_THAT(cli::render_panel(left), HasSubstr("a square of 12."));
  EXPECT_TRUE(get("/panels/P-0001")["remnant"].is_object());
}

TEST_F(PanelRemnants, TellsWhatWasBookedOfAPanel) {
  EXPECT_EQ(cli::render_remnants({{"remnants", json::array()}}), "Nothing was booked of this panel yet.\n");
  // Numbers are given over all panels, in whatever order these were counted: none is to come in between.
  for (const char* panel : {"P-0001", "P-0002"}) until_what_is_left_is_booked(panel);
  const json first = get("/panels/P-0002/remnants?limit=5")["remnants"];
  ASSERT_EQ(first.size(), 1U) << first.dump();
  const int of_other = get("/panels/P-0001")["remnant"]["booked"]["number"], number = first[0]["number"];
  EXPECT_NE(number, of_other);
  const int next = std::max(number, of_other) + 1;
  EXPECT_TRUE(get("/panels/P-0002")["remnant"]["booked"]["is_now"].get<bool>());
  EXPECT_EQ(ask("GET", first[0]["picture"].get<std::string>()).status, 200);
  change([](Repositories& r) {
    db::RemnantRecord remnant;
    remnant.panel = {"P-0002"}, remnant.mask_version = 1, remnant.counted_of = "other wood", remnant.at = kThen;
    remnant.woods = {{"walnut", SquareMillimetres(1250)}};
    remnant.square = db::RemnantRecord::Room{point<PanelFrame>(5, 6), 12_mm};
    return r.remnants.book(remnant);
  });
  const json booked = get("/panels/P-0002")["remnant"]["booked"];
  EXPECT_EQ(booked, (json{{"number", next}, {"run", nullptr}, {"at", kThen}, {"is_now", false}}));
  EXPECT_THAT(cli::render_panel(get("/panels/P-0002")), HasSubstr("; its wood changed since"));
  const json all = get("/panels/P-0002/remnants?limit=5");
  ASSERT_EQ(all["remnants"].size(), 2U) << all.dump();
  EXPECT_EQ(all["remnants"][1], first[0]);
  EXPECT_EQ(all["remnants"][0]["square"], (json{{"side_mm", 12.0}, {"x_mm", 5.0}, {"y_mm", 6.0}}));
  EXPECT_TRUE(all["remnants"][0]["circle"].is_null());
  EXPECT_TRUE(all["remnants"][0]["picture"].is_null());
  EXPECT_THAT(cli::render_remnants(all), HasSubstr("walnut 12 cm2"));
  const auto picture_of = [&](int its_number) {
    return ask("GET", fmt::format("/api/v1/panels/P-0002/remnant.png?booked={}", its_number)).status;
  };
  EXPECT_EQ(picture_of(number), 200);
  EXPECT_EQ(picture_of(next), 404) << "it was not drawn";
  EXPECT_EQ(picture_of(of_other), 404) << "it is of the other panel";
  EXPECT_EQ(picture_of(next + 1), 404);
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/remnants").status, 404);
}

TEST_F(PanelRemnants, ThePictureOfARemnantIsPaleWhereNothingIsFree) {
  change([](Repositories& r) {
    return r.ledger.write_off({"P-0002"}, Region<PanelFrame>(panel_square(2, 2, 6)), "a knot", kThen);
  });
  const ApiReply reply = ask("GET", "/api/v1/panels/P-0002/remnant.png");
  ASSERT_EQ(reply.status, 200) << reply.body;
  const cv::Mat picture = *planner::decode_picture(reply.body, "remnant");
  ASSERT_EQ(picture.size(), cv::Size(kColumns, kRows));
  // This wood is white; what is not free is a little grey.
  const auto at = [&](double x_mm, double y_mm) {
    return picture.at<cv::Vec3b>(kRows - cvRound(y_mm * 300 / 25.4), cvRound(x_mm * 300 / 25.4));
  };
  EXPECT_EQ(at(29, 1), cv::Vec3b(255, 255, 255));
  EXPECT_EQ(at(5, 5), cv::Vec3b(240, 240, 240));
  EXPECT_EQ(ask("GET", "/api/v1/panels/P-0009/remnant.png").status, 404);
}

}  // namespace
}  // namespace veneer::daemon
