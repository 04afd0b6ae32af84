// What the status says in which state: of a real unit on a laser without bytes, with what the database told as a test
// sets it.
#include "daemon/news/cell_status.h"

#include <gmock/gmock.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/daemon/news/told_cell.h"
#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kNever = "2999-01-01T00:00:00.000Z";

class CellStatusTest : public JobRunnerTest {
 protected:
  void SetUp() override {
    JobRunnerTest::SetUp();
    cell_.emplace(io_, dir_.path(), *database_, *runner_, options_, laser_);
    count();
  }
  void TearDown() override {
    cell_.reset();
    JobRunnerTest::TearDown();
  }

  // As the database tells it, with a certificate of the scanner besides: nothing has to be calibrated.
  void count() {
    auto counted = database_->call([](Repositories& r) { return count_cell(r); });
    ASSERT_TRUE(counted.ok());
    cell_->counts = std::move(*counted);
    certify(db::CertificateKind::kScanner, kNever);
  }
  void certify(db::CertificateKind kind, const std::string& until) {
    cell_->counts.calibration->standing[kind] = {CertificateState::kValid, CertificateId{9}, until};
  }
  json told(Role role = Role::kOperator) { return cell_->status.tell(role); }
  std::string step() { return told()["next_step"]["step"]; }
  json lock(const std::string& name, Role role = Role::kOperator) {
    const json all = told(role);
    for (const json& one : all["interlocks"])
      if (one["name"] == name) return one;
    return {};
  }

  std::optional<tests::ToldCell> cell_;
};

TEST_F(CellStatusTest, LeadsThroughAJobFromResetToTheLastPiece) {
  EXPECT_EQ(told()["state"], "Stopped");
  EXPECT_EQ(step(), "reset");
  EXPECT_EQ(told()["next_step"]["job"], 1);
  EXPECT_TRUE(told()["laser"]["position_mm"].is_null()) << "nobody has connected it";
  EXPECT_EQ(told()["lid"], "unknown");

  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(told()["state"], "Idle");
  EXPECT_EQ(step(), "start");
  EXPECT_EQ(told()["laser"]["position_mm"], json({0.0, 0.0}));
  EXPECT_EQ(told()["lid"], "closed");
  EXPECT_TRUE(told()["job"].is_null());

  ASSERT_TRUE(start().ok());
  EXPECT_EQ(told()["state"], "Suspended");
  EXPECT_EQ(step(), "load");
  EXPECT_EQ(told()["job"]["now"], "waits for panel P-0001");
  EXPECT_EQ(told()["load"]["panel"], "P-0001");
  EXPECT_EQ(told()["load"]["found"], false);
  EXPECT_TRUE(told()["load"]["rms_mm"].is_null()) << "nothing was fitted";

  bed_.lay("P-0001"), look();
  EXPECT_EQ(step(), "confirm");
  EXPECT_EQ(told()["load"]["found"], true);
  EXPECT_EQ(told()["load"]["rms_mm"], 0.02);

  laser_.burn_at_once = false;
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(told()["state"], "Execute");
  EXPECT_EQ(step(), "wait");
  EXPECT_EQ(told()["job"]["current_piece"], "A1-1");
  EXPECT_EQ(told()["job"]["now"], "is cutting piece A1-1");
  EXPECT_TRUE(told()["load"].is_null());

  laser_.burn_at_once = true;
  laser_.finish(), settle();
  EXPECT_EQ(told()["load"]["panel"], "P-0002");
  EXPECT_EQ(told()["job"]["cut"], 2);
  bed_.lay("P-0002"), look();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_EQ(told()["state"], "Complete");
  EXPECT_EQ(told()["job"]["cut"], 3);
  EXPECT_TRUE(told()["job"]["now"].is_null()) << "it is over";
  EXPECT_EQ(step(), "reset");
}

TEST_F(CellStatusTest, SaysOfAHeldCutWhatHoldsItAndWhatGoesOn) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(command(CellCommand::kHold).ok());
  EXPECT_EQ(told()["state"], "Held");
  EXPECT_EQ(step(), "unhold");
  EXPECT_EQ(told()["job"]["now"], "is held");
  EXPECT_EQ(lock("stop")["state"], "blocks");
  EXPECT_EQ(lock("stop")["sentence"], told()["reason"]);
  laser_.open_lid();
  EXPECT_EQ(told()["lid"], "open");
  EXPECT_EQ(lock("lid")["remedy"], "Close the lid.");
}

TEST_F(CellStatusTest, SaysOfAStopWhoSaidItAndThatClearComesFirst) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  tell(
      CellCommand::kAbort, [](const Status&) {}, "user anna");
  settle(), count();
  EXPECT_EQ(told()["state"], "Aborted");
  EXPECT_THAT(told()["reason"], HasSubstr("STOP by user anna"));
  EXPECT_EQ(step(), "clear");
  EXPECT_EQ(told()["job"]["suspect"], 1) << "the piece that was begun";
  EXPECT_THAT(told()["next"], HasSubstr("veneerctl job settle 1"));
}

TEST_F(CellStatusTest, TellsTimesOnTheClockOfPeople) {
  laser_.burn_at_once = false;
  load_first_panel();
  const double device_seconds = told()["load"]["estimate_s"];
  cell_->config.sim.time_scale = 4;
  EXPECT_DOUBLE_EQ(told()["load"]["estimate_s"], device_seconds / 4);
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  EXPECT_DOUBLE_EQ(told()["job"]["eta_s"], runner_->view().job->eta_seconds / 4);
}

// It is counted when something changes; that a day passes changes nothing.
TEST_F(CellStatusTest, ACertificateRunsOutByItself) {
  certify(db::CertificateKind::kKerf, "2026-05-01T12:00:00.000Z");
  cell_->now += std::chrono::hours(12) - std::chrono::milliseconds(1);
  EXPECT_EQ(told()["calibration"]["kerf"], "valid");
  EXPECT_EQ(step(), "reset");
  cell_->now += std::chrono::milliseconds(1);
  EXPECT_EQ(told()["calibration"]["kerf"], "expired");
  EXPECT_EQ(step(), "calibrate_kerf");
  EXPECT_EQ(lock("certificates")["state"], "blocks");
}

TEST_F(CellStatusTest, AsksForNothingBeforeItKnowsWhatTheDatabaseHolds) {
  cell_->counts = {};
  EXPECT_FALSE(cell_->status.is_counted());
  EXPECT_EQ(lock("certificates")["state"], "unknown");
  EXPECT_EQ(step(), "wait") << told()["next_step"] << " might calibrate what is calibrated";
  tell(CellCommand::kAbort), settle();
  EXPECT_EQ(step(), "clear") << "what the unit wants is known";
}

TEST_F(CellStatusTest, NamesTheFirstPanelsToScanAndCountsThemAll) {
  for (int i = 10; i < 35; ++i) cell_->counts.panels_to_scan.push_back(PanelId{"P-00" + std::to_string(i)});
  EXPECT_EQ(told()["panels_to_scan"]["count"], 25);
  EXPECT_EQ(told()["panels_to_scan"]["panels"].size(), 20U);
  EXPECT_EQ(told()["panels_to_scan"]["panels"][0], "P-0010");
}

TEST_F(CellStatusTest, TellsOfScansThatWaitForTheirNextTile) {
  EXPECT_TRUE(told()["open_scan"].is_null());
  EXPECT_TRUE(told()["kept_scan"].is_null());
  cell_->open_scan = ScanSeries::Open{PanelId{"P-0001"}, Face::kBack, 2, false};
  cell_->kept_scan = ScanSeries::Kept{3, tests::kThen};
  EXPECT_EQ(told()["open_scan"], json({{"panel", "P-0001"}, {"face", "back"}, {"tiles", 2}, {"retag", false}}));
  EXPECT_EQ(told()["kept_scan"], json({{"tiles", 3}, {"since", tests::kThen}}));
}

TEST_F(CellStatusTest, ListsTheTasksThatRunAndCountsAlarmsByTheirState) {
  const TaskReporter scan = cell_->tasks.start("scan", "scanning"), plan = cell_->tasks.start("plan", "matching");
  scan.done({{"panel", "P-0003"}});
  settle();
  ASSERT_EQ(told()["tasks"].size(), 1U);
  EXPECT_EQ(told()["tasks"][0]["id"], plan.id());
  cell_->alarms.take({{"held", false, "the lid was opened"}, {"laser", true, "it does not answer"}}, tests::kThen);
  EXPECT_TRUE(cell_->alarms.acknowledge(1, "user anna", tests::kThen).ok());
  cell_->alarms.happened({"task 7", false, "scan: the lamp is cold"}, tests::kThen);
  EXPECT_EQ(told()["alarms"], json({{"new", 1}, {"acknowledged", 1}, {"returned", 1}}));
}

TEST_F(CellStatusTest, AsksByNameWhatTheOperatorAndTheMachineWantConfirmed) {
  options_.confirm = {"exhaust"};
  laser_.to_confirm = {"no homing"};
  EXPECT_EQ(told()["confirm"], json({"exhaust"}));
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  EXPECT_EQ(told()["confirm"], json({"exhaust", "no homing"})) << "as far as the machine is known";
}

TEST_F(CellStatusTest, TellsWhetherAGuardianWatches) {
  EXPECT_EQ(lock("guardian")["state"], "unknown");
  cell_->guarded = [] { return Status(Error{ErrorCode::kUnavailable, "no guardian watches the laser's port"}); };
  EXPECT_EQ(lock("guardian")["sentence"], "no guardian watches the laser's port");
  cell_->guarded = Ok;
  EXPECT_EQ(lock("guardian")["state"], "good");
}

TEST_F(CellStatusTest, TellsHowOldWhatADeviceGaveLastIs) {
  EXPECT_EQ(lock("camera")["state"], "unknown");
  EXPECT_FALSE(cell_->camera.capture().ok());
  cell_->now = std::chrono::system_clock::now() + std::chrono::minutes(3);
  EXPECT_EQ(lock("camera")["state"], "blocks");
  EXPECT_EQ(lock("camera")["sentence"], "the camera is not plugged in");
  EXPECT_GE(lock("camera")["age_s"], 179);
  EXPECT_THAT(lock("camera", Role::kViewer)["sentence"], HasSubstr("an operator is told why"));
}

// Boards of its kind may be found at sockets that no configuration names.
TEST_F(CellStatusTest, AViewerIsNotToldWhyTheLaserDoesNotAnswer) {
  laser_.present = false, laser_.says_why = true;
  laser_.absence = "boards of its kind answer at usb:1-2.4 and usb:1-3: say which";
  ASSERT_FALSE(command(CellCommand::kReset).ok());
  EXPECT_EQ(told()["state"], "Aborted");
  EXPECT_EQ(told()["laser"]["why_not_connected"], laser_.absence);
  EXPECT_THAT(told()["reason"], HasSubstr("usb:1-2.4"));
  EXPECT_THAT(told(Role::kViewer)["reason"], HasSubstr("an operator is told why"));
  EXPECT_THAT(told(Role::kViewer).dump(), Not(HasSubstr("usb:1-2.4")));
}

TEST_F(CellStatusTest, AViewerIsToldNoPortAndNoPathInAnySentence) {
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  ASSERT_TRUE(start().ok());
  bed_.seen = Error{ErrorCode::kUnavailable, "the camera's file /var/lib/veneerd/bed.jpg cannot be read"};
  look();
  const TaskReporter run = cell_->tasks.start("laser run", "writing to /dev/ttyUSB7");
  const std::string all = told().dump(), less = told(Role::kViewer).dump();
  EXPECT_THAT(all, HasSubstr("/var/lib/veneerd/bed.jpg"));
  EXPECT_THAT(all, HasSubstr("ttyUSB7"));
  EXPECT_THAT(less, Not(HasSubstr("/var/lib")));
  EXPECT_THAT(less, Not(HasSubstr("ttyUSB7")));
  EXPECT_THAT(less, HasSubstr("cannot be read")) << "that it is so, everybody may know";
}

TEST_F(CellStatusTest, AnAuditThatKnowsOfChosenDevicesTellsThatTheirFileIsGone) {
  cell_->config.camera.set_by = SetBy::kNobody;
  const auto choose = [](Repositories& r) {
    return r.audit.append({0, tests::kThen, "uid 1000", db::kDeviceChosen, "camera"});
  };
  ASSERT_TRUE(database_->call(choose).ok());
  EXPECT_FALSE(cell_->status.needs().choice_lost);
  cell_->status.look_for_lost_choice(*database_);
  settle();
  EXPECT_TRUE(cell_->status.needs().choice_lost);
  // An answer for a cell that is gone finds nobody.
  cell_->status.look_for_lost_choice(*database_);
  cell_.reset();
  settle();
}

}  // namespace
}  // namespace veneer::daemon
