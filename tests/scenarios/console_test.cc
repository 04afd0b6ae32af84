// An operator's short day in the browser, and more of what is done there when all goes well.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/scenarios/console_cell.h"

namespace veneer::tests {
namespace {

TEST_F(Console, AnOperatorsShortDay) {
  play("console_day.py");
  // STOP was the last of it.
  EXPECT_EQ(get("/status")["state"], "Aborted");
  const nlohmann::json second = get("/jobs/2");
  EXPECT_EQ(second["cut"], second["pieces"]) << "what the page made and cut is in the ledger";
  EXPECT_EQ(get("/plans/2")["options"]["pinned_vertices"], "");
  EXPECT_THAT(get("/plans/3")["options"]["pinned_vertices"].get<std::string>(), ::testing::StartsWith("1,1,1"))
      << "where lines meet, more than 10 mm from the left";
  // One piece of the third plan was to have other wood.
  const nlohmann::json other = get("/plans/4");
  EXPECT_EQ(other["parent"], 3);
  EXPECT_EQ(other["options"]["forbid"].size(), 1U) << other["options"];
  const nlohmann::json was = get("/plans/3/pieces")["pieces"], is = get("/plans/4/pieces")["pieces"];
  ASSERT_EQ(was.size(), is.size());
  int moved = 0;
  for (std::size_t i = 0; i < was.size(); ++i) moved += was[i]["panel_outline_mm"] != is[i]["panel_outline_mm"];
  EXPECT_EQ(moved, 1);
}

TEST_F(Console, StopIsSentUntilItIsHeardAndStartBeginsWhatItsLabelSays) {
  play("console_stop.py");
  EXPECT_EQ(get("/status")["job"]["id"], kJob);
}

TEST_F(Console, PiecesAreLaidAndTickedOff) {
  play("console_assembly.py");
  const nlohmann::json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["assembled"], 1) << "of two, one was lost";
  EXPECT_EQ(job["runs"][0]["who"], "console link 1 of uid 0") << "who gave the word for it";
}

TEST_F(Console, WoodShelfPlansAndBackups) {
  play("console_stock.py");
  EXPECT_EQ(get("/panels/P-0002")["treatments"].size(), 1U);
  // What was wanted of single pieces of the third plan is in the fourth.
  EXPECT_EQ(get("/plans/3")["parent"], 2);
  EXPECT_EQ(get("/plans/4")["parent"], 3);
  const auto pieces_of = [this](int plan) {
    std::map<std::string, nlohmann::json> out;
    const nlohmann::json all = get(fmt::format("/plans/{}/pieces", plan));
    for (const auto& piece : all["pieces"]) out[piece["mark"].get<std::string>()] = piece["panel_outline_mm"];
    return out;
  };
  const auto first = pieces_of(2), was = pieces_of(3), is = pieces_of(4);
  EXPECT_EQ(first, was) << "only other places were looked for";
  const nlohmann::json places = get("/plans/3/pieces/A2-2/alternatives");
  for (int i = 0; i < 4; ++i)
    for (const int axis : {0, 1})
      EXPECT_NEAR(is.at("A2-2")[i][axis].get<double>(),
                  places["alternatives"][0]["panel_outline_mm"][i][axis].get<double>(), 0.001);
  for (const char* moved : {"A1-2", "A1-3", "A3-1"}) EXPECT_NE(is.at(moved), was.at(moved)) << moved;
  for (const char* stays : {"A1-1", "A2-1", "A2-3", "A3-2", "A3-3"}) EXPECT_EQ(is.at(stays), was.at(stays)) << stays;
  const nlohmann::json zones = get(fmt::format("/panels/{}", kPanel))["zones"];
  for (const auto& zone : zones)
    EXPECT_EQ(zone["material"], std::string(zone["zone"] == 2 ? "maple" : "walnut")) << zone;
  const nlohmann::json decided = get("/proposals?all=true")["proposals"];
  EXPECT_TRUE(std::ranges::any_of(decided,
                                  [](const nlohmann::json& one) {
                                    return one.value("remarks", nlohmann::json()).size() == 1 &&
                                           one["decided"].is_object() && one["decided"]["verdict"] == "accepted";
                                  }))
      << "an odd size was remarked upon, and what the page put beside it answered: " << decided;
}

}  // namespace
}  // namespace veneer::tests
