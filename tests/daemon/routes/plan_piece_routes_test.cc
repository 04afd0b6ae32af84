// One piece of a plan through the API: its other places, and how its wood looks there.
#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "planner/files/plan_files.h"
#include "tests/support/panel_shapes.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::panel_square;

constexpr const char* kPlannedOn = "2026-05-01T07:30:00.000Z";

// A panel of 61 x 41 mm that is red on the left and blue on the right, and a plan of two pieces, both in the red: A1, a
// triangle of 6 mm, and A2, a square. A1 has three other places: in the blue; in the blue, turned by 180 degrees; in
// the red.
class PlanPieceRoutes : public testing::RoutedCell {
 protected:
  PlanPieceRoutes() {
    cv::Mat map(480, 720, CV_8UC3, cv::Scalar(0, 0, 200));
    map(cv::Rect(360, 0, 360, 480)).setTo(cv::Scalar(200, 0, 0));
    db::PanelRecord panel;
    panel.id = {"P-0001"}, panel.name = "walnut", panel.width = 60.96_mm, panel.height = 40.64_mm;
    panel.created_at = kPlannedOn;
    const auto picture = cell->panel_library.store_picture(map, "panels", "map");
    if (!picture) throw std::runtime_error(picture.error().message);
    panel.map_file = panel.mask_file = picture->file, panel.map_hash = picture->sha256;
    change([&](Repositories& r) { return r.panels.add(panel, {}, {}); });
  }

  static planner::Placement placed(double degrees_turned, double x, double y) {
    return {{"P-0001"}, {degrees(degrees_turned), point<PanelFrame>(x, y)}};
  }
  static planner::Plan drawn() {
    planner::Plan plan;
    plan.dpi = 300, plan.kerf = 0.25_mm;
    plan.artworks = {{"portrait", "A", 12_mm, 6_mm}};
    plan.panels = {{{"P-0001"}, 60.96_mm, 40.64_mm, 300}};
    planner::Piece& triangle = plan.pieces.emplace_back();
    triangle.mark = "A1", triangle.cost = 50, triangle.pixels = 100, triangle.column = 0;
    triangle.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(6, 0), point<ArtworkFrame>(0, 6)};
    triangle.placement = placed(0, 5, 5);
    triangle.alternatives = {{placed(0, 40, 5), 40}, {placed(180, 50, 30), 60}, {placed(0, 5, 20), 75}};
    planner::Piece& square = plan.pieces.emplace_back();
    square.mark = "A2", square.cost = 80, square.pixels = 100, square.column = 1;
    square.artwork_outline = {point<ArtworkFrame>(6, 0), point<ArtworkFrame>(12, 0), point<ArtworkFrame>(12, 6),
                              point<ArtworkFrame>(6, 6)};
    square.placement = placed(90, 20, 5);
    return plan;
  }
  void store(const planner::Plan& plan, const json& options = {{"alternatives", 3}}) {
    db::NewPlan out;
    out.name = "portrait", out.who = "uid 1000";
    out.plan_json = planner::plan_to_json(plan), out.options_json = options.dump();
    out.planned_on = {{PanelId{"P-0001"}, 1}};
    for (const planner::Piece& piece : plan.pieces) {
      db::PlannedPatch& patch = out.pieces.emplace_back();
      patch.mark = piece.mark, patch.artwork_outline = piece.artwork_outline;
      patch.panel = piece.placement->panel, patch.panel_outline = piece.panel_outline();
      patch.panel_from_artwork = piece.placement->panel_from_artwork;
      patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), plan.kerf);
    }
    change([&](Repositories& r) -> Status {
      const auto added = r.plans.add(out, kPlannedOn);
      return added ? Ok() : Status(added.error());
    });
  }
  // Wood of another job, a square of 4 mm.
  void reserve(double x, double y) {
    db::NewPlan out;
    out.name = "other", out.who = "uid 1000", out.plan_json = "{}", out.options_json = "{}";
    out.planned_on = {{PanelId{"P-0001"}, 1}};
    db::PlannedPatch& patch = out.pieces.emplace_back();
    patch.mark = "B1", patch.panel = PanelId{"P-0001"};
    patch.panel_outline = panel_square(x, y, 4);
    for (const auto& p : patch.panel_outline)
      patch.artwork_outline.push_back(point<ArtworkFrame>(p.x.count() - x, p.y.count() - y));
    patch.panel_from_artwork = {Radians(0), point<PanelFrame>(x, y)};
    patch.allocation = offset(Region<PanelFrame>(patch.panel_outline), 0.25_mm);
    change([&](Repositories& r) -> Status {
      const auto made = r.jobs.create(out, kPlannedOn);
      return made ? Ok() : Status(made.error());
    });
  }
  template <class F>
  void change(F work) {
    const Status done = cell->database->call([&](Repositories& r) -> Status { return work(r); });
    if (!done) throw std::runtime_error(done.error().message);
  }
  json get(const std::string& path) { return body_of(ask("GET", "/api/v1/plans/1/pieces/" + path)); }
  int status(const std::string& path) { return ask("GET", "/api/v1/plans/1/pieces/" + path).status; }
  cv::Mat wood(const std::string& path) {
    const ApiReply reply = ask("GET", "/api/v1/plans/1/pieces/" + path);
    EXPECT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.content_type, "image/png");
    return cv::imdecode(std::vector<std::uint8_t>(reply.body.begin(), reply.body.end()), cv::IMREAD_UNCHANGED);
  }
};

bool is_red(const cv::Vec4b& pixel) { return pixel[2] > 180 && pixel[0] < 20; }
bool is_blue(const cv::Vec4b& pixel) { return pixel[0] > 180 && pixel[2] < 20; }

TEST_F(PlanPieceRoutes, TellWhereElseAPieceCouldBeCutBesideItsOwnCost) {
  store(drawn());
  const json told = get("A1/alternatives");
  EXPECT_EQ(told["place"]["panel"], "P-0001");
  EXPECT_DOUBLE_EQ(told["place"]["cost_per_pixel"], 0.5);
  EXPECT_EQ(told["placed"], 2);
  EXPECT_EQ(told["worse"], 1) << "A2 costs more";
  EXPECT_DOUBLE_EQ(told["kerf_mm"], 0.25);
  ASSERT_EQ(told["alternatives"].size(), 3U);
  EXPECT_EQ(told["alternatives"][1]["number"], 2);
  EXPECT_DOUBLE_EQ(told["alternatives"][1]["cost_per_pixel"], 0.6);
  EXPECT_NEAR(std::abs(told["alternatives"][1]["rotation_deg"].get<double>()), 180, 1e-9);
  EXPECT_NEAR(told["alternatives"][1]["panel_outline_mm"][1][0].get<double>(), 44, 1e-9);
  EXPECT_EQ(told["next"], nullptr);
  EXPECT_EQ(told["none_because"], nullptr);
  const json second = get("A1/alternatives?limit=1&cursor=1");
  ASSERT_EQ(second["alternatives"].size(), 1U);
  EXPECT_EQ(second["alternatives"][0], told["alternatives"][1]);
  EXPECT_EQ(second["next"], 2);
}

TEST_F(PlanPieceRoutes, TellWhichPlaceSomebodyElseHasTaken) {
  store(drawn());
  reserve(42, 6);
  const json places = get("A1/alternatives")["alternatives"];
  EXPECT_EQ(places[0]["free"], false);
  EXPECT_EQ(places[1]["free"], true);
  EXPECT_EQ(places[2]["free"], true);
}

TEST_F(PlanPieceRoutes, SayWhyThereIsNoPlaceAndHowToGetThem) {
  planner::Plan plan = drawn();
  plan.pieces[0].alternatives.clear();
  store(plan, {{"alternatives", 0}});
  EXPECT_THAT(get("A1/alternatives")["none_because"].get<std::string>(),
              HasSubstr("veneerctl job change 1 --alternatives 6"));
  EXPECT_EQ(get("A1/alternatives")["alternatives"], json::array());
}

TEST_F(PlanPieceRoutes, SayThatNoPlaceWasFoundWhereTheyWereLookedFor) {
  store(drawn());
  EXPECT_THAT(get("A2/alternatives")["none_because"].get<std::string>(), HasSubstr("no other place was found"));
}

TEST_F(PlanPieceRoutes, SayThatLimitsOfWoodsLeftPlacesOut) {
  store(drawn(), {{"alternatives", 3}, {"wood_limit", {{"oak", 0.5}}}});
  EXPECT_THAT(get("A2/alternatives")["none_because"].get<std::string>(),
              HasSubstr("in the wood that plan 1 leaves free and the limits of its woods allow: take wood of another "
                        "piece (swap), plan the picture anew with higher limits, or scan more wood"));
}

TEST_F(PlanPieceRoutes, ShowTheWoodOfAPlaceCutToThePiece) {
  store(drawn());
  const cv::Mat own = wood("A1/wood.png?width=60");
  ASSERT_EQ(own.type(), CV_8UC4);
  ASSERT_EQ(own.size(), cv::Size(60, 60));
  EXPECT_TRUE(is_red(own.at<cv::Vec4b>(45, 15)));
  EXPECT_EQ(own.at<cv::Vec4b>(45, 15)[3], 255);
  EXPECT_EQ(own.at<cv::Vec4b>(15, 45)[3], 0) << "beyond the longest side of the triangle";
  for (const char* blue : {"A1/wood.png?width=60&alternative=1", "A1/wood.png?width=60&alternative=2"})
    EXPECT_TRUE(is_blue(wood(blue).at<cv::Vec4b>(45, 15))) << blue;
  EXPECT_EQ(wood("A1/wood.png?width=2048").size(), cv::Size(71, 71)) << "no finer than the map";
}

// The border of red and blue is at 30.48 mm; the piece crosses it, and the border of two tiles as well.
TEST_F(PlanPieceRoutes, TurnAndShrinkTheWoodAsThePieceLies) {
  planner::Plan plan = drawn();
  planner::Piece& square = plan.pieces[1];
  square.artwork_outline = {point<ArtworkFrame>(0, 0), point<ArtworkFrame>(30, 0), point<ArtworkFrame>(30, 30),
                            point<ArtworkFrame>(0, 30)};
  square.placement = placed(90, 45.48, 5);  // what lies to the left on the panel is up in the picture
  store(plan);
  for (const int side : {300, 40}) {
    const cv::Mat seen = wood("A2/wood.png?width=" + std::to_string(side));
    ASSERT_EQ(seen.size(), cv::Size(side, side));
    for (const int across : {side / 8, side / 2, side * 7 / 8}) {
      EXPECT_TRUE(is_red(seen.at<cv::Vec4b>(side / 2 - side / 10, across))) << side << " " << across;
      EXPECT_TRUE(is_blue(seen.at<cv::Vec4b>(side / 2 + side / 10, across))) << side << " " << across;
    }
  }
}

TEST_F(PlanPieceRoutes, ShowAPieceInAnotherOnesPlace) {
  planner::Plan plan = drawn();
  plan.pieces[1].placement = placed(0, 40, 25);  // in the blue
  store(plan);
  EXPECT_TRUE(is_blue(wood("A1/wood.png?width=60&swap=A2").at<cv::Vec4b>(45, 15)));
  EXPECT_TRUE(is_red(wood("A2/wood.png?width=60&swap=A1").at<cv::Vec4b>(45, 15)));
}

TEST_F(PlanPieceRoutes, RefuseWhatThePlanDoesNotHave) {
  store(drawn());
  EXPECT_EQ(status("A9/alternatives"), 404);
  EXPECT_THAT(ask("GET", "/api/v1/plans/1/pieces/A9/wood.png").body, HasSubstr("plan 1 has no piece A9"));
  EXPECT_EQ(status("A1/wood.png?alternative=4"), 404);
  EXPECT_EQ(status("A1/wood.png?alternative=0"), 400);
  EXPECT_EQ(status("A1/wood.png?swap=A9"), 404);
  EXPECT_EQ(status("A1/wood.png?swap=A2&alternative=1"), 400);
  EXPECT_EQ(ask("GET", "/api/v1/plans/9/pieces/A1/alternatives").status, 404);
}

// What was asked for once before is kept.
TEST_F(PlanPieceRoutes, TellNothingOfAPlanThatIsGone) {
  store(drawn());
  EXPECT_EQ(status("A1/alternatives"), 200);
  change([](Repositories& r) { return r.plans.remove(db::PlanId{1}); });
  EXPECT_EQ(status("A1/alternatives"), 404);
  EXPECT_EQ(status("A1/wood.png"), 404);
}

}  // namespace
}  // namespace veneer::daemon
