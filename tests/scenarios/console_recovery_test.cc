// What an operator does in the browser about what went wrong: another panel on the bed, STOP in the middle, a panel
// that was lifted.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/scenarios/console_cell.h"

namespace veneer::tests {
namespace {

class ConsoleAfterTrouble : public Console {};

TEST_F(ConsoleAfterTrouble, AWrongPanelAStopInTheMiddleAndWhatComesAfter) {
  play("console_recovery.py");
  const nlohmann::json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["state"], "complete");
  EXPECT_EQ(job["cut"], 16);
  EXPECT_EQ(job["suspect"], 0);
  ASSERT_EQ(job["runs"].size(), 3U) << "broken off, the rest, and the piece that was lost";
  EXPECT_EQ(job["runs"][1]["result"], "done");
  const nlohmann::json second = get("/jobs/2");
  EXPECT_GT(second["pieces"], 1);
  EXPECT_EQ(second["state"], "complete");
  EXPECT_EQ(second["cut"], second["pieces"]);
  EXPECT_EQ(second["suspect"], 0);
}

class ConsoleAfterALift : public Console {
 protected:
  double time_scale() const override { return 10; }
  SimulatedCellOptions options() const override {
    return OperatedCell::options();  // NOLINT(bugprone-parent-virtual-call): nothing is asked by name
  }
  std::map<std::string, int> pieces() {
    std::map<std::string, int> out;
    const nlohmann::json all = get(fmt::format("/jobs/{}/pieces", kJob));
    for (const auto& piece : all["pieces"]) ++out[piece["state"].get<std::string>()];
    return out;
  }
};

// The panel was lifted with the fourth piece half cut; the laser went on over the bare bed.
TEST_F(ConsoleAfterALift, WhatTheScanSawOfManyPiecesIsSaidAtOnce) {
  cut_some();
  lift();
  wait_state("Held");
  ASSERT_EQ(post("/commands/stop"), "");
  wait_state("Stopped");
  ASSERT_TRUE(story_->reconcile(kJob).ok());
  ASSERT_EQ(pieces(), (std::map<std::string, int>{{"suspect", 16}}));
  play("console_settle.py");
  const auto now = pieces();
  EXPECT_GE(now.at("cut"), 3);
  EXPECT_GE(now.at("released"), 10);
  EXPECT_LE(now.contains("suspect") ? now.at("suspect") : 0, 1) << "perhaps the one that was half cut";
}

}  // namespace
}  // namespace veneer::tests
