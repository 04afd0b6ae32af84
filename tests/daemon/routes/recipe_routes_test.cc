// Recipes, the wood of zones, test cards and cut files, as the API has them, on a cell whose laser is a file.
#include <gmock/gmock.h>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

using RecipeRoutes = testing::RoutedCell;

TEST_F(RecipeRoutes, ARecipeIsWrittenListedAndForgotten) {
  const auto written = ask("POST", "/api/v1/recipes/black%20walnut/cut",
                           {{"speed_mm_s", 9}, {"power", 0.8}, {"passes", 2}, {"kerf_back_mm", 0.31}});
  EXPECT_EQ(written.status, 200) << written.body;
  const json list = body_of(ask("GET", "/api/v1/recipes"))["recipes"];
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["material"], "black walnut");
  EXPECT_EQ(list[0]["passes"], 2);
  EXPECT_EQ(list[0]["air"], true);
  EXPECT_EQ(list[0]["kerf_back_mm"], 0.31);
  EXPECT_EQ(list[0]["kerf_show_mm"], 0.31) << "one kerf stands for both faces";
  EXPECT_EQ(ask("DELETE", "/api/v1/recipes/black%20walnut/cut").status, 200);
  EXPECT_EQ(ask("DELETE", "/api/v1/recipes/black%20walnut/cut").status, 404);
}

TEST_F(RecipeRoutes, WhatCannotBeIsRefusedByName) {
  const auto message = [&](const std::string& operation, const json& body) {
    const auto reply = ask("POST", "/api/v1/recipes/oak/" + operation, body);
    EXPECT_EQ(reply.status, 400) << reply.body;
    return reply.body;
  };
  EXPECT_THAT(message("cut", {{"power", 0.5}}), HasSubstr("speed_mm_s is missing"));
  EXPECT_THAT(message("cut", {{"speed_mm_s", 9}, {"power", "high"}}), HasSubstr("it must be a number from 0 to 1"));
  EXPECT_THAT(message("cut", {{"speed_mm_s", 9}, {"power", 1.5}}), HasSubstr("power is 1.5"));
  EXPECT_THAT(message("cut", {{"speed_mm_s", 9}, {"power", 0}}), HasSubstr("impossible power"));
  EXPECT_THAT(message("cut", {{"speed_mm_s", 9}, {"power", 0.5}, {"passes", 1.5}}), HasSubstr("passes"));
  EXPECT_THAT(message("engrave", {{"speed_mm_s", 9}, {"power", 0.5}, {"kerf_back_mm", 0.2}}), HasSubstr("only cuts"));
  EXPECT_THAT(message("plane", {{"speed_mm_s", 9}, {"power", 0.5}}), HasSubstr("cut or engrave"));
}

TEST_F(RecipeRoutes, APersonNamesTheWoodOfAZone) {
  cell->database->call([](Repositories& r) {
    db::PanelRecord panel;
    panel.id = panel.root = *r.panels.next_panel_id();
    panel.name = panel.id.value;
    panel.width = 420_mm, panel.height = 280_mm;
    panel.created_at = "2026-05-01T07:30:00.000Z";
    EXPECT_TRUE(r.panels.add(panel, {}, {}).ok());
    const auto strip = [](double x) {
      return Ring<PanelFrame>{point<PanelFrame>(x, 0), point<PanelFrame>(x + 90, 0), point<PanelFrame>(x + 90, 200)};
    };
    EXPECT_TRUE(
        r.materials
            .add_zones(panel.id, {{1, Region<PanelFrame>(strip(0)), ""}, {2, Region<PanelFrame>(strip(100)), ""}})
            .ok());
    return 0;
  });
  const auto named = ask("POST", "/api/v1/panels/P-0001/material", {{"material", "walnut"}, {"zone", 2}});
  ASSERT_EQ(named.status, 200) << named.body;
  const json zones = body_of(named)["zones"];
  EXPECT_TRUE(zones[0]["material"].is_null());
  EXPECT_EQ(zones[1]["material"], "walnut");
  EXPECT_NEAR(zones[1]["area_mm2"].get<double>(), 9000, 1e-6);
  const auto drawn =
      ask("POST", "/api/v1/panels/P-0001/zones", {{"zone", 2}, {"outline_mm", {100, 0, 150, 0, 150, 60, 100, 60}}});
  ASSERT_EQ(drawn.status, 200) << drawn.body;
  EXPECT_EQ(body_of(drawn)["zone"], 2);
  EXPECT_NEAR(body_of(drawn)["zones"][1]["area_mm2"].get<double>(), 3000, 1e-6);
  EXPECT_EQ(body_of(drawn)["zones"][1]["version"], 2);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0001/zones", {{"outline_mm", {100, 0, 150, 0}}}).status, 400);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0001/zones", {{"outline_mm", {900, 0, 950, 0, 950, 60}}}).status, 400);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0001/material", {{"material", "oak"}, {"zone", 7}}).status, 404);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0009/material", {{"material", "oak"}}).status, 404);
  EXPECT_EQ(ask("POST", "/api/v1/panels/P-0001/material", {{"wood", "oak"}}).status, 400);
}

TEST_F(RecipeRoutes, ATestCardIsDrawnOnDemandAndNothingMoves) {
  const auto drawn = ask("POST", "/api/v1/test-card", {{"powers", {0.4, 0.8}}, {"speeds_mm_s", {8, 16, 24}}});
  ASSERT_EQ(drawn.status, 200) << drawn.body;
  const json card = body_of(drawn);
  EXPECT_THAT(card["svg"].get<std::string>(), HasSubstr("data-power=\"0.800\" data-speed=\"24.000\""));
  EXPECT_THAT(card["egv"].get<std::string>(), HasSubstr("FNSE"));
  EXPECT_FALSE(std::filesystem::exists(directory / "wire.bin"));
  EXPECT_EQ(ask("POST", "/api/v1/test-card", {{"powers", "all"}}).status, 400);
  EXPECT_THAT(ask("POST", "/api/v1/test-card", {{"side_mm", 50}, {"operation", "engrave"}}).body,
              HasSubstr("leaves the travel"));
}

TEST_F(RecipeRoutes, ACardOfACellThatIsNotIdleHomesTheLaserFirst) {
  const auto begun = ask("POST", "/api/v1/laser/test-card");
  ASSERT_EQ(begun.status, 202) << begun.body;
  // The camera looks for stock before anything moves.
  while (cell->runner->view().state == CellState::kStopped && !cell->tasks.running().empty()) {
    reactor.restart();
    reactor.run_one_for(std::chrono::seconds(10));
  }
  reactor.restart();
  reactor.poll();  // what the task tells comes after it
  const auto tasks = cell->tasks.list();
  ASSERT_EQ(tasks.size(), 1U);
  EXPECT_THAT(to_text(*tasks[0]), HasSubstr("homing the laser"));
  EXPECT_EQ(cell->runner->view().state, CellState::kResetting);
}

TEST_F(RecipeRoutes, ACutFileNeedsAJobAndAPanel) {
  EXPECT_EQ(ask("GET", "/api/v1/jobs/3/cut.egv?panel=P-0001").status, 404);
}

}  // namespace
}  // namespace veneer::daemon
