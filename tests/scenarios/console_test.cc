// An operator's short day in the browser, and more of what is done there when all goes well.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
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
  const nlohmann::json zones = get(fmt::format("/panels/{}", kPanel))["zones"];
  for (const auto& zone : zones)
    EXPECT_EQ(zone["material"], std::string(zone["zone"] == 2 ? "maple" : "walnut")) << zone;
  const nlohmann::json decided = get("/proposals?all=true")["proposals"];
  EXPECT_TRUE(std::ranges::any_of(decided, [](const nlohmann::json& one) {
    return std::ranges::count(one["decided"]["overruled"], "size") == 1;
  })) << decided;
}

}  // namespace
}  // namespace veneer::tests
