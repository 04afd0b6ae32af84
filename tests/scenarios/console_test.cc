// An operator's short day in the browser: Debian's chromium, driven by console_day.py over WebDriver, on the simulated
// cell. What hands do at the machine the script does with `veneerctl sim`.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>

#include "base/files.h"
#include "tests/scenarios/operated_cell.h"
#include "tests/support/sane_config.h"

namespace veneer::tests {
namespace {

class Console : public OperatedCell {
 protected:
  // Slow enough that Hold is pressed while something is left to cut.
  double time_scale() const override { return 6; }
  SimulatedCellOptions options() const override {
    SimulatedCellOptions out = OperatedCell::options();
    out.daemon_tables = "[before_motion]\nconfirm = [\"exhaust\", \"air assist\"]\n";
    return out;
  }
  // In the browser, by one of the scripts beside this file. Its pictures outlive a failure, so that it is seen what the
  // operator saw.
  void play(const char* script) {
    std::ofstream(dir_ / "second.png", std::ios::binary) << target();
    const std::filesystem::path pictures = VENEER_PAGES;
    std::filesystem::create_directories(pictures);
    const auto program = std::filesystem::path(VENEER_CONSOLE_DAY).replace_filename(script);
    auto day = ChildProcess::start({"/usr/bin/python3", program.string(), link(), pictures.string()}, dir_ / "day.log",
                                   {{"VENEERCTL", (bin_dir() / "veneerctl").string()},
                                    {"VENEERD_SOCKET", cell_->api_socket().string()},
                                    {"VENEER_TWIN_SOCKET", cell_->twin_socket().string()},
                                    {"PICTURE", (dir_ / "second.png").string()}});
    ASSERT_TRUE(day.ok()) << day.error().message;
    EXPECT_EQ(day->wait(), 0) << read_whole(dir_ / "day.log").value_or("no log");
  }
  std::string link() const {
    const auto made = cell_->api().post("/console-links");
    return made ? (*made)["url"].get<std::string>() : made.error().message;
  }
};

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
  EXPECT_TRUE(std::ranges::any_of(decided, [](const nlohmann::json& one) {
    return std::ranges::count(one["decided"]["overruled"], "size") == 1;
  })) << decided;
}

TEST_F(Console, AWrongPanelAStopInTheMiddleAndWhatComesAfter) {
  play("console_recovery.py");
  const nlohmann::json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["state"], "complete");
  EXPECT_EQ(job["cut"], 16);
  EXPECT_EQ(job["suspect"], 0);
  ASSERT_EQ(job["runs"].size(), 3U) << "broken off, the rest, and the piece that was lost";
  EXPECT_EQ(job["runs"][1]["result"], "done");
  EXPECT_GT(get("/jobs/2")["pieces"], 0);
}

class ConsoleAfterALift : public Console {
 protected:
  double time_scale() const override { return 10; }
  SimulatedCellOptions options() const override { return OperatedCell::options(); }  // nothing is asked by name
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

// Nothing prepared: what the page makes of an unpacked machine. The twin's pictures are as coarse as the certificates'
// limits allow, since making them is most of what this costs.
TEST(FirstDay, FromTheUnpackedMachineToTheFirstCutPiece) {
  const testing::TempDirectory dir(testing::TempDirectory::Place::kDisk);
  SimulatedCellOptions options{
      dir / "cell", std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin", 3, 40};
  options.twin_tables = "sheet_dpi = 200\n";
  options.daemon_tables = "[devices]\nchoose = true\n";
  // Its own backends, not whatever scanners the house has.
  testing::write_sane_config(dir / "sane");
  options.scanner = "kind = \"sim\"\nsane_config_dir = \"" + (dir / "sane").string() + "\"\n";
  auto cell = SimulatedCell::start(options);
  ASSERT_TRUE(cell.ok()) << cell.error().message;
  std::ofstream((*cell)->data_dir() / "camera" / "bed.jpg") << "a picture";
  const auto link = (*cell)->api().post("/console-links", {{"role", "maintainer"}});
  ASSERT_TRUE(link.ok()) << link.error().message;
  const std::filesystem::path pictures = VENEER_PAGES;
  std::filesystem::create_directories(pictures);
  auto day = ChildProcess::start(
      {"/usr/bin/python3", VENEER_SETUP_DAY, (*link)["url"].get<std::string>(), pictures.string()}, dir / "day.log");
  ASSERT_TRUE(day.ok()) << day.error().message;
  const int status = day->wait();
  EXPECT_EQ(status, 0) << read_whole(dir / "day.log").value_or("no log");
  const auto job = (*cell)->api().get("/jobs/1");
  ASSERT_TRUE(job.ok()) << job.error().message;
  EXPECT_GT((*job)["cut"], 0);
  EXPECT_EQ((*job)["cut"], (*job)["pieces"]);
}

}  // namespace
}  // namespace veneer::tests
