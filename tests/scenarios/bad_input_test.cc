// Bad input ends in one sentence that names the thing and what to do, with nothing half-booked and the beam off.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>

#include "tests/scenarios/prepared_cell.h"

namespace veneer::tests {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class BadInput : public PreparedCell {
 protected:
  // The error of a task or request, and that it left nothing behind.
  void expect_refused(const Result<json>& result, const std::string& names) {
    ASSERT_FALSE(result.ok()) << result->dump();
    EXPECT_THAT(result.error().message, HasSubstr(names));
    EXPECT_FALSE(get("/status")["laser"]["beam_on"].get<bool>());
    EXPECT_EQ(get("/jobs")["jobs"].size(), 1U);
    EXPECT_EQ(get("/panels")["panels"].size(), 1U);
  }
  Result<json> new_job(const std::string& picture, const std::string& query) {
    auto started = cell_->api().request("POST", "/jobs?name=test&" + query, picture, "application/octet-stream");
    if (!started) return started;
    return cell_->api().wait_task((*started)["task"]);
  }
  void place(const std::string& sheet, const std::string& on, const std::string& face) {
    auto placed = cell_->twin({{"cmd", "place"}, {"sheet", sheet}, {"on", on}, {"face", face}, {"part", "whole"}});
    ASSERT_TRUE(placed.ok()) << placed.error().message;
  }
  void fault(const std::string& name, const json& value) {
    auto set = cell_->twin({{"cmd", "fault"}, {"name", name}, {"value", value}});
    ASSERT_TRUE(set.ok()) << set.error().message;
  }
  void start_job() {
    ASSERT_TRUE(cell_->api().post("/commands/reset").ok());
    ASSERT_TRUE(cell_->api().post(fmt::format("/jobs/{}/start", kJob)).ok());
  }
  // Until the camera has looked at what lies on the bed now.
  std::string sentence_with(const std::string& words) {
    auto status = cell_->wait_status(
        [&](const json& s) {
          return s["load"].is_object() && s["load"].value("sentence", "").find(words) != std::string::npos;
        },
        std::chrono::seconds(60));
    return status ? (*status)["load"]["sentence"].get<std::string>() : status.error().message;
  }
};

TEST_F(BadInput, AnUnreadablePictureIsNamed) {
  expect_refused(new_job("this is no picture", "size_mm=48&patch_mm=12"), "test");
}

TEST_F(BadInput, AMissingPictureIsSaid) { expect_refused(new_job("", "size_mm=48&patch_mm=12"), "picture is missing"); }

TEST_F(BadInput, TooLittleFreeWoodReservesNothing) {
  expect_refused(new_job(target(), "size_mm=200&patch_mm=12"), "nothing is reserved: no free wood was left for");
  EXPECT_EQ(get(fmt::format("/panels/{}/ledger", kPanel))["allocations"].size(), 16U);
}

TEST_F(BadInput, ASheetWithoutTagsIsNotAPanel) {
  ASSERT_TRUE(cell_->twin({{"cmd", "new-board"}, {"name", "bare"}, {"width_mm", 200}, {"height_mm", 150}}).ok());
  place("bare", "scanner", "show");
  expect_refused(cell_->api().post_and_wait("/scans"), "no fiducials");
}

TEST_F(BadInput, AScannerThatIsNotThereIsNamed) {
  fault("scanner_dead", true);
  expect_refused(cell_->api().post_and_wait("/scans"), "scanner");
}

TEST_F(BadInput, ALaserThatIsNotThereEndsAborted) {
  fault("laser_unplug", true);
  expect_refused(cell_->api().post("/commands/reset"), "laser");
  EXPECT_EQ(get("/status")["state"], "Aborted");
}

TEST_F(BadInput, TheWrongFaceIsNotCut) {
  start_job();
  place("control", "bed", "show");
  EXPECT_THAT(sentence_with("turn it over"), HasSubstr(kPanel));
  expect_refused(cell_->api().post("/commands/unsuspend"), "turn it over");
  EXPECT_EQ(get("/status")["state"], "Suspended");
}

TEST_F(BadInput, AStrangePanelIsNotCut) {
  ASSERT_TRUE(cell_->twin({{"cmd", "new-panel"}, {"name", "stranger"}, {"width_mm", 200}, {"height_mm", 140}}).ok());
  start_job();
  place("stranger", "bed", "back");
  EXPECT_THAT(sentence_with(fmt::format("lay panel {}", kPanel)), HasSubstr("back face up"));
  expect_refused(cell_->api().post("/commands/unsuspend"), kPanel);
}

// The pattern was burnt in an earlier life of the daemon; its board is still the one to measure.
TEST_F(BadInput, TheKerfCanBeMeasuredAgainAfterARestart) {
  auto placed =
      cell_->twin({{"cmd", "place"}, {"sheet", "board"}, {"on", "scanner"}, {"face", "show"}, {"part", "left"}});
  ASSERT_TRUE(placed.ok()) << placed.error().message;
  auto kerf = cell_->api().post_and_wait("/calibration/kerf");
  ASSERT_TRUE(kerf.ok()) << kerf.error().message;
  EXPECT_NEAR((*kerf)["figures"].value("kerf_mm", 0.0), 0.27, 0.1);
}

TEST_F(BadInput, AJobThatDoesNotExistIsNamed) {
  ASSERT_TRUE(cell_->api().post("/commands/reset").ok());
  expect_refused(cell_->api().post("/jobs/99/start"), "99");
  EXPECT_EQ(get("/status")["state"], "Idle");
}

TEST_F(BadInput, ABrokenConfigurationIsRefusedWithLineAndKey) {
  const auto file = dir_ / "broken.toml";
  std::ofstream(file) << "[laser]\nkind = \"sim\"\nprot = \"/dev/ttyUSB0\"\n";
  const Finished finished = run_program({(bin_dir() / "veneerd").string(), "--config", file.string()});
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.output, AllOf(HasSubstr("broken.toml:3"), HasSubstr("laser.prot")));
}

TEST_F(BadInput, KilledInTheMiddleOfACutTheCellComesBackAbortedWithOnePieceSuspect) {
  start_job();
  place("control", "bed", "back");
  sentence_with("found");
  signal_at_burn(cell_->daemon_pid(), SIGKILL, 160);
  ASSERT_TRUE(cell_->api().post("/commands/unsuspend").ok());
  ASSERT_EQ(cell_->wait_daemon(), 128 + SIGKILL);
  ASSERT_TRUE(cell_->start_daemon().ok());
  const json status = get("/status");
  EXPECT_EQ(status["state"], "Aborted");
  const json job = get(fmt::format("/jobs/{}", kJob));
  EXPECT_EQ(job["state"], "aborted");
  EXPECT_EQ(job["suspect"], 1);
  EXPECT_GE(job["cut"].get<int>(), 2);
  EXPECT_FALSE(cell_->api().post("/commands/unhold").ok());
  EXPECT_FALSE(cell_->api().post(fmt::format("/jobs/{}/start", kJob)).ok());
}

// The twin itself presses STOP, at a place of the cut. However late the daemon hears of it: no more than a second's
// motion is queued, and the piece, begun 40 mm before, burns for longer.
TEST_F(BadInput, StopNeedsNothingAndSwitchesTheBeamOff) {
  start_job();
  place("control", "bed", "back");
  sentence_with("found");
  stop_at_burn(100);
  ASSERT_TRUE(cell_->api().post("/commands/unsuspend").ok());
  auto aborted = cell_->wait_status([](const json& s) { return s["state"] == "Aborted"; }, std::chrono::seconds(20));
  ASSERT_TRUE(aborted.ok());
  EXPECT_FALSE((*aborted)["laser"]["beam_on"].get<bool>());
  EXPECT_EQ((*aborted)["job"]["suspect"], 1);
}

}  // namespace
}  // namespace veneer::tests
