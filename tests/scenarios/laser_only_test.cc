// A laser and nothing else, as somebody has it who has just unpacked it: the real daemon and veneerctl on a controller.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "base/files.h"
#include "tests/support/laser_only_cell.h"

namespace veneer::tests {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class LaserOnly : public ::testing::Test {
 protected:
  void start(const sim::GrblSettings& settings = LaserOnlyCell::quick_laser(), const LoneDaemonOptions& options = {}) {
    auto started = LaserOnlyCell::start(bin_dir(), settings, options);
    ASSERT_TRUE(started.ok()) << started.error().message;
    cell = std::move(*started);
  }
  static fs::path bin_dir() { return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin"; }
  void expect_clean() {
    const sim::BeamLog log = cell->laser.beam_log();
    EXPECT_EQ(log.beam_at_rest_s, 0);
    EXPECT_EQ(log.burnt_unhomed_mm, 0);
    EXPECT_EQ(log.lost_bytes, 0U);
    EXPECT_FALSE(cell->laser.beam_on());
  }
  std::unique_ptr<LaserOnlyCell> cell;
};

TEST_F(LaserOnly, BurnsATestPatternOnOneCommand) {
  start();
  const Finished burnt = cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_THAT(burnt.output, HasSubstr("The test pattern is burnt"));
  // Outline, diagonals, circle, ticks, and the square that is cut out.
  EXPECT_NEAR(cell->laser.burnt_mm(), 80 + 2 * 28.28 + 50.2 + 2 * (2 + 4 + 2) + 16, 1.0);
  EXPECT_EQ(cell->state(), "Complete");
  expect_clean();
}

// By an operator with a browser, at a real cell: what its status says after a dark run is what the page waits for.
TEST_F(LaserOnly, ADrawingIsBurntFromThePageOnceItWasTraced) {
  LoneDaemonOptions options;
  options.listen = "127.0.0.1:0";
  start(LaserOnlyCell::quick_laser(), options);
  const fs::path drawing = cell->data() / "frame.svg", log = cell->data() / "day.log";
  std::ofstream(drawing) << R"(<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">
      <g stroke="#f00" fill="none"><path d="M10 10 h60 v40 h-60 z"/></g></svg>)";
  const auto link = cell->api().post("/console-links", {{"role", "operator"}});
  ASSERT_TRUE(link.ok()) << link.error().message;
  fs::create_directories(VENEER_PAGES);
  const auto script = fs::path(VENEER_CONSOLE_DAY).replace_filename("console_drawing.py");
  auto day =
      ChildProcess::start({"/usr/bin/python3", script.string(), (*link)["url"].get<std::string>(), VENEER_PAGES}, log,
                          {{"VENEERCTL", (bin_dir() / "veneerctl").string()},
                           {"VENEERD_SOCKET", cell->socket()},
                           {"DRAWING", drawing.string()}});
  ASSERT_TRUE(day.ok()) << day.error().message;
  EXPECT_EQ(day->wait(), 0) << read_whole(log).value_or("no log");
  EXPECT_NEAR(cell->laser.burnt_mm(), 200, 1.0) << "once, and only when Burn was pressed";
  expect_clean();
}

TEST_F(LaserOnly, TheApiIsToldByNameWhatWasSeenTo) {
  start();
  const auto refused = cell->api().post("/laser/test-pattern", {{"confirmed", {"exhaust", "cooling"}}});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("air assist"));
  EXPECT_EQ(cell->state(), "Stopped") << "and nothing was homed";
  const Finished partly = cell->veneerctl({"laser", "test-pattern", "--confirm", "exhaust"});
  EXPECT_EQ(partly.status, 2);
  EXPECT_THAT(partly.output, HasSubstr("--confirm \"air assist\""));
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
}

// Each of them homes first, unless the cell is Idle; none does under an open lid, and nothing is homed for what is
// refused.
TEST_F(LaserOnly, AsksForTheLidBeforeItHomes) {
  start();
  const std::string file = cell->socket() + ".svg";
  std::ofstream(file) << R"(<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">
      <g stroke="#f00"><path d="M10 10 h60 v40 h-60 z"/></g></svg>)";
  const std::vector<std::vector<std::string>> commands = {
      {"laser", "test-pattern", "--size-mm", "20"},
      {"laser", "test-pattern", "--size-mm", "20", "--dry"},
      {"laser", "test-pattern", "--size-mm", "20", "--check"},
      {"recipe", "card", "cut", "--powers", "50%", "--speeds-mm-s", "100", "--side-mm", "5", "--burn"},
      {"laser", "run", file, "--power", "50%", "--speed-mm-s", "200", "--x-mm", "100", "--y-mm", "120"}};
  ASSERT_EQ(cell->veneerctl({"laser", "test-pattern", "--size-mm", "20", "--dry"}).status, 0);
  ASSERT_EQ(cell->state(), "Complete");
  const auto homings = [&] {
    const std::string all = cell->laser.received();
    std::size_t count = 0;
    for (std::size_t at = all.find("$H"); at != std::string::npos; at = all.find("$H", at + 1)) ++count;
    return count;
  };
  const std::size_t before = homings();
  cell->laser.set_lid(true);
  ASSERT_TRUE(cell->wait_for([&] {
    const auto status = cell->api().get("/status");
    return status && (*status)["lid"] == "open";
  }));
  for (const auto& command : commands) {
    const Finished refused = cell->veneerctl_seen_to(command);
    EXPECT_EQ(refused.status, 1) << refused.output;
    EXPECT_THAT(refused.output, HasSubstr("the lid is open: close it"));
    EXPECT_EQ(cell->state(), "Complete");
  }
  EXPECT_EQ(homings(), before);
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
  cell->laser.set_lid(false);
  ASSERT_TRUE(cell->wait_for([&] {
    const auto status = cell->api().get("/status");
    return status && (*status)["lid"] == "closed";
  }));
  const Finished burnt = cell->veneerctl_seen_to(commands.front());
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_EQ(homings(), before + 1);
}

TEST_F(LaserOnly, RunsItDryWithTheBeamOffAndReadsItWithoutMoving) {
  start();
  const Finished checked = cell->veneerctl({"laser", "test-pattern", "--size-mm", "20", "--check"});
  EXPECT_EQ(checked.status, 0) << checked.output;
  EXPECT_THAT(cell->laser.received(), HasSubstr("$C\n"));
  EXPECT_THAT(cell->laser.received(), HasSubstr("S850"));
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
  const Finished dry = cell->veneerctl({"laser", "test-pattern", "--size-mm", "20", "--dry"});
  EXPECT_EQ(dry.status, 0) << dry.output;
  EXPECT_EQ(cell->laser.beam_log().beam_on_s, 0);
  expect_clean();
}

TEST_F(LaserOnly, BurnsWhereTheHeadStandsOnAMachineWithoutSwitches) {
  sim::GrblSettings settings = LaserOnlyCell::quick_laser();
  settings.set(20, 0);
  settings.set(22, 0);
  start(settings);
  const Finished burnt = cell->veneerctl_seen_to({"laser", "test-pattern", "--size-mm", "20"});
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_GT(cell->laser.burnt_mm(), 200);
  EXPECT_THAT(cell->laser.received(), Not(HasSubstr("$H")));
  // It comes back to the corner, so the next run is where this one was.
  for (int i = 0; i < 3; ++i) {
    const Finished dry = cell->veneerctl({"laser", "test-pattern", "--size-mm", "20", "--dry"});
    EXPECT_EQ(dry.status, 0) << dry.output;
    const auto status = cell->api().get("/status");
    ASSERT_TRUE(status.ok());
    EXPECT_NEAR((*status)["laser"]["position_mm"][0].get<double>(), 0, 0.02);
    EXPECT_NEAR((*status)["laser"]["position_mm"][1].get<double>(), 0, 0.02);
    EXPECT_NE((*status)["reason"], "the pattern is burnt") << "it was dry";
  }
  EXPECT_THAT(cell->veneerctl({"status"}).output, HasSubstr("counts from the corner it was given"));
  EXPECT_EQ(cell->veneerctl({"laser", "here"}).status, 0);
}

TEST_F(LaserOnly, ATestCardReturnsToTheCornerOfAMachineWithoutSwitches) {
  sim::GrblSettings settings = LaserOnlyCell::quick_laser();
  settings.set(20, 0);
  settings.set(22, 0);
  start(settings);
  const auto expect_at_the_corner = [&](const char* when) {
    const auto status = cell->api().get("/status");
    ASSERT_TRUE(status.ok());
    EXPECT_NEAR((*status)["laser"]["position_mm"][0].get<double>(), 0, 0.02) << when;
    EXPECT_NEAR((*status)["laser"]["position_mm"][1].get<double>(), 0, 0.02) << when;
  };
  std::vector<std::string> card = {"recipe",        "card", "cut",       "--powers", "50%",
                                   "--speeds-mm-s", "100",  "--side-mm", "5",        "--burn"};
  std::vector<std::string> dry = card;
  dry.emplace_back("--dry");
  // The first is at home nowhere yet, and is not held against the travel before; the next ones are.
  for (int i = 0; i < 2; ++i) {
    const Finished ran = cell->veneerctl(dry);
    EXPECT_EQ(ran.status, 0) << ran.output;
    expect_at_the_corner("behind a dry run");
  }
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
  const Finished burnt = cell->veneerctl_seen_to(card);
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_GT(cell->laser.burnt_mm(), 20);
  expect_at_the_corner("behind a burnt one");
}

TEST_F(LaserOnly, JogsOnlyAHomedHead) {
  start();
  EXPECT_EQ(cell->veneerctl({"laser", "jog", "--x-mm", "-10"}).status, 1) << "not before a Reset";
  ASSERT_EQ(cell->veneerctl({"reset"}).status, 0);
  const Finished jogged = cell->veneerctl({"laser", "jog", "--x-mm", "-10", "--y-mm", "-5"});
  EXPECT_EQ(jogged.status, 0) << jogged.output;
  EXPECT_TRUE(cell->wait_for([&] {
    const auto status = cell->api().get("/status");
    return status && (*status)["laser"]["position_mm"].is_array() &&
           std::abs((*status)["laser"]["position_mm"][0].get<double>() - 509) < 0.02 &&
           (*status)["laser"]["state"] == "Idle";
  }));
  EXPECT_THAT(cell->veneerctl({"laser", "override", "--power", "90"}).output, HasSubstr("for what runs"));
}

TEST_F(LaserOnly, TurnsOverridesWithinWhatWasStatedAndTheyEndWithThePattern) {
  start();
  ASSERT_TRUE(cell->begin_pattern(100).ok());
  ASSERT_TRUE(cell->wait_for([&] { return cell->laser.beam_on(); }));
  EXPECT_THAT(cell->veneerctl({"laser", "override", "--power", "110"}).output, HasSubstr("10 to 100"));
  // Two at once: the second is meant beside the first, which the machine has not reached yet.
  EXPECT_EQ(cell->veneerctl({"laser", "override", "--power", "50"}).status, 0);
  const Finished turned = cell->veneerctl({"laser", "override", "--feed", "150"});
  EXPECT_EQ(turned.status, 0) << turned.output;
  EXPECT_THAT(turned.output, HasSubstr("Feed 150 %, rapid 100 %, power 50 %"));
  EXPECT_TRUE(cell->wait_for([&] {
    const auto status = cell->api().get("/status");
    return status && (*status)["laser"]["overrides"] == nlohmann::json{{"feed", 150}, {"rapid", 100}, {"power", 50}};
  }));
  EXPECT_EQ(cell->veneerctl({"laser", "override", "--power", "5"}).status, 2);
  EXPECT_THAT(cell->veneerctl({"status"}).output, HasSubstr("feed 150 %, power 50 %"));
  // They end with what ran.
  ASSERT_TRUE(cell->wait_for([&] { return cell->state() == "Complete"; }));
  EXPECT_EQ(cell->veneerctl({"laser", "jog", "--x-mm", "-5"}).status, 0) << "and the head may be moved aside";
  EXPECT_TRUE(cell->wait_for([&] {
    const auto status = cell->api().get("/status");
    return status && (*status)["laser"]["overrides"] == nlohmann::json{{"feed", 100}, {"rapid", 100}, {"power", 100}};
  }));
}

TEST_F(LaserOnly, RunsADrawingDryAndThenBurnsItWhereItSaid) {
  start();
  const std::string file = cell->socket() + ".svg";
  std::ofstream(file) << R"(<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">
      <g id="engrave"><circle cx="40" cy="30" r="10"/></g><g stroke="#f00"><path d="M10 10 h60 v40 h-60 z"/></g></svg>)";
  const Finished unsaid = cell->veneerctl({"laser", "run", file, "--dry"});
  EXPECT_EQ(unsaid.status, 2);
  EXPECT_THAT(unsaid.output, HasSubstr("nothing says how to burn #ff0000"));
  const std::vector<std::string> how = {"--layer", "#ff0000:power=50%,speed=200", "--x-mm", "100", "--y-mm", "120"};
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> all = {"laser", "run", file};
    all.insert(all.end(), how.begin(), how.end());
    all.insert(all.end(), more.begin(), more.end());
    return cell->veneerctl(all);
  };
  const Finished dry = run({"--dry"});
  EXPECT_EQ(dry.status, 0) << dry.output;
  EXPECT_THAT(dry.output, HasSubstr("x 100.0 to 160.0 mm, y 120.0 to 160.0 mm"));
  EXPECT_THAT(dry.output, HasSubstr("nothing is burnt"));
  EXPECT_EQ(cell->laser.beam_log().beam_on_s, 0);
  EXPECT_THAT(run({"--confirm", "exhaust"}).output, HasSubstr("air assist"));
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
  std::vector<std::string> all_seen_to;
  const auto status = cell->api().get("/status");
  ASSERT_TRUE(status.ok());
  for (const auto& name : (*status)["confirm"])
    all_seen_to.insert(all_seen_to.end(), {"--confirm", name.get<std::string>()});
  const Finished burnt = run(all_seen_to);
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  EXPECT_THAT(burnt.output, HasSubstr("It is burnt."));
  EXPECT_NEAR(cell->laser.burnt_mm(), 200 + 2 * 3.14159 * 10, 0.5);
  expect_clean();
  const Finished beyond = cell->veneerctl(
      {"laser", "run", file, "--dry", "--power", "10%", "--speed-mm-s", "50", "--x-mm", "500", "--y-mm", "0"});
  EXPECT_EQ(beyond.status, 1);
  EXPECT_THAT(beyond.output, HasSubstr("leaves the laser's travel"));
}

TEST_F(LaserOnly, BurnsATestCardAndKeepsTheRecipeItGave) {
  start();
  std::vector<std::string> card = {"recipe",        "card",        "cut",       "--powers", "50%,100%",
                                   "--speeds-mm-s", "100,200,300", "--side-mm", "5",        "--burn"};
  EXPECT_THAT(cell->veneerctl(card).output, HasSubstr("exhaust"));
  EXPECT_EQ(cell->state(), "Stopped") << "and nothing was homed";
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
  const auto status = cell->api().get("/status");
  ASSERT_TRUE(status.ok());
  for (const auto& name : (*status)["confirm"]) card.insert(card.end(), {"--confirm", name.get<std::string>()});
  const Finished burnt = cell->veneerctl(card);
  EXPECT_EQ(burnt.status, 0) << burnt.output;
  // Six squares, and their labels.
  EXPECT_GT(cell->laser.burnt_mm(), 6 * 20 + 50);
  EXPECT_LT(cell->laser.burnt_mm(), 6 * 20 + 250);
  expect_clean();
  const Finished kept = cell->veneerctl({"recipe", "set", "walnut", "cut", "--speed-mm-s", "12", "--power", "80%",
                                         "--kerf-back-mm", "0.31", "--kerf-show-mm", "0.22"});
  EXPECT_EQ(kept.status, 0) << kept.output;
  const Finished list = cell->veneerctl({"recipe", "list"});
  for (const char* word : {"walnut", "12 mm/s", "80 %", "0.31 mm", "0.22 mm"})
    EXPECT_THAT(list.output, HasSubstr(word));
  const Finished removed = cell->veneerctl({"recipe", "remove", "walnut", "cut"});
  EXPECT_EQ(removed.status, 0) << removed.output;
  EXPECT_THAT(removed.output, HasSubstr("The recipe of walnut, cut, is removed."));
  EXPECT_EQ(cell->veneerctl({"recipe", "remove", "walnut", "cut"}).status, 1);
}

TEST_F(LaserOnly, DrawsATestCardAsAPictureAndAsAFileForOtherLasers) {
  start();
  const std::string file = cell->socket() + ".card";
  EXPECT_EQ(cell->veneerctl({"recipe", "card", "engrave", "--out", file + ".svg"}).status, 0);
  EXPECT_EQ(cell->veneerctl({"recipe", "card", "--out", file + ".egv"}).status, 0);
  EXPECT_GT(fs::file_size(file + ".svg"), 10000U);
  EXPECT_GT(fs::file_size(file + ".egv"), 1000U);
  EXPECT_EQ(cell->veneerctl({"recipe", "card", "--out", file + ".dxf"}).status, 2);
  EXPECT_EQ(cell->veneerctl({"recipe", "card"}).status, 2);
  EXPECT_EQ(cell->laser.burnt_mm(), 0);
}

// Any client, nobody logged in, while a job streams. How fast it is, `./dev soak stop` measures.
TEST_F(LaserOnly, StopPutsTheResetOnTheWireAndTheBeamOut) {
  start();
  for (const bool by_command : {false, true}) {
    ASSERT_TRUE(cell->begin_pattern(300).ok());
    ASSERT_TRUE(cell->wait_for([&] { return cell->laser.beam_on(); }));
    const std::size_t before = cell->laser.resets().size();
    if (by_command)
      EXPECT_EQ(cell->veneerctl({"stop"}).status, 0);
    else
      EXPECT_TRUE(cell->api().post("/stop").ok());
    ASSERT_TRUE(cell->wait_for([&] { return cell->laser.resets().size() > before && !cell->laser.moving(); }));
    EXPECT_FALSE(cell->laser.beam_on());
    cell->laser.set_consent(false);
    ASSERT_TRUE(cell->wait_for([&] { return cell->state() == "Aborted"; }));
    EXPECT_EQ(cell->laser.beam_log().moved_without_consent_mm, 0);
    EXPECT_EQ(cell->veneerctl_seen_to({"laser", "test-pattern"}).status, 1) << "an aborted cell wants Clear first";
    cell->laser.set_consent(true);
    ASSERT_TRUE(cell->api().post("/commands/clear").ok());
  }
}

}  // namespace
}  // namespace veneer::tests
