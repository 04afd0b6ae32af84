// Calibrations as the API begins them, on a cell whose laser is a file.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "daemon/calibration/calibration_service.h"
#include "daemon/routes/cell_routes.h"
#include "daemon/store/calibration.h"
#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using ::testing::HasSubstr;

class CalibrationRoutes : public testing::RoutedCell {
 protected:
  // Runs the reactor until the unit is in this state, or the task that leads there has ended.
  bool reach(CellState state) {
    while (cell->runner->view().state != state && !cell->tasks.running().empty()) {
      reactor.restart();
      reactor.run_one_for(std::chrono::seconds(10));
    }
    return cell->runner->view().state == state;
  }
};

// The run's looks at the bed wait for the same camera: a calibration that hangs would hold the run for minutes.
TEST_F(CalibrationRoutes, TheCameraBelongsToWhatTheUnitIsAbout) {
  ASSERT_EQ(ask("POST", "/api/v1/laser/test-pattern", {{"dry", true}}).status, 202);
  ASSERT_TRUE(reach(CellState::kExecute)) << to_text(*cell->tasks.list().front());
  const std::size_t tasks = cell->tasks.list().size();
  const ApiReply refused = ask("POST", "/api/v1/calibration/camera");
  EXPECT_EQ(refused.status, 409) << refused.body;
  EXPECT_THAT(refused.body, HasSubstr("looks at the bed"));
  EXPECT_THAT(body_of(refused)["error"].value("remedy", ""), HasSubstr("Stop"));
  const ApiReply sought = ask("POST", "/api/v1/cameras");
  const ApiReply tried = ask("POST", "/api/v1/cameras/trial", {{"device", "/dev/v4l/by-id/usb-Cam-index0"}});
  for (const ApiReply& busy : {sought, tried}) {
    EXPECT_EQ(busy.status, 409) << busy.body;
    EXPECT_THAT(busy.body, HasSubstr("looks at the bed"));
  }
  EXPECT_EQ(cell->tasks.list().size(), tasks);
  EXPECT_EQ(ask("POST", "/api/v1/calibration/scanner").status, 202) << "the scanner has a thread of its own";
  ASSERT_TRUE(reach(CellState::kComplete)) << cell->runner->view().reason;
  EXPECT_EQ(ask("POST", "/api/v1/calibration/camera").status, 202);
}

// The camera looks for a board of that size before anything is burnt, and before anything moves.
TEST_F(CalibrationRoutes, TheLaserIsToldHowLargeTheBoardIs) {
  for (const nlohmann::json& body : {nlohmann::json{{"confirmed", {"board on the bed", "board not seen"}}},
                                     nlohmann::json{{"board_width_mm", 300}}}) {
    const ApiReply refused = ask("POST", "/api/v1/calibration/laser", body);
    EXPECT_EQ(refused.status, 400) << refused.body;
    EXPECT_THAT(refused.body, HasSubstr("--board-height-mm"));
  }
  EXPECT_TRUE(cell->tasks.list().empty());
}

// What can be known before the first byte is asked before it: this cell is Stopped, and its laser's file still empty.
class CalibrateLaserUnhomed : public CalibrationRoutes {
 protected:
  ApiReply calibrate(double width, double height, std::vector<std::string> confirmed = {"board on the bed"}) {
    return ask("POST", "/api/v1/calibration/laser",
               {{"board_width_mm", width}, {"board_height_mm", height}, {"confirmed", std::move(confirmed)}});
  }
  void expect_nothing_moved() {
    EXPECT_EQ(cell->runner->view().state, CellState::kStopped);
    EXPECT_FALSE(cell->runner->is_connected());
    std::error_code none;
    const auto bytes = std::filesystem::file_size(directory / "wire.bin", none);
    EXPECT_TRUE(none || bytes == 0) << bytes;
  }
};

TEST_F(CalibrateLaserUnhomed, RefusesABoardWithoutRoomForThePattern) {
  for (const auto& [width, height] : {std::pair{100, 80}, {300, 150}, {140, 250}}) {
    const ApiReply refused = calibrate(width, height);
    EXPECT_EQ(refused.status, 400) << refused.body;
    EXPECT_THAT(refused.body, HasSubstr("too small for the pattern"));
  }
  expect_nothing_moved();
}

TEST_F(CalibrateLaserUnhomed, RefusesWithoutACertificateOfTheCamera) {
  const TaskView task = ended(calibrate(300, 300));
  ASSERT_EQ(task.state, TaskState::kFailed);
  EXPECT_THAT(task.error->message, HasSubstr("run veneerctl calibrate camera before calibrate laser"));
  expect_nothing_moved();
}

TEST_F(CalibrateLaserUnhomed, RefusesWithoutAPictureOfTheBed) {
  db::CertificateRecord camera;
  camera.kind = db::CertificateKind::kCamera;
  camera.issued_at = "2026-01-01T00:00:00.000Z", camera.expires_at = "2999-01-01T00:00:00.000Z";
  nlohmann::json payload = to_payload(calib::CameraFit{});
  payload["device"] = device_name(camera.kind, cell_devices(*cell->devices.scanner, *cell->devices.camera, config));
  camera.payload = payload.dump();
  ASSERT_TRUE(cell->database->call([&](Repositories& r) { return r.certificates.issue(camera); }).ok());
  const TaskView task = ended(calibrate(300, 300));
  ASSERT_EQ(task.state, TaskState::kFailed);
  EXPECT_THAT(task.error->message, HasSubstr("no picture matches"))
      << "the certificate is there, and the camera is asked";
  expect_nothing_moved();
}

// As in the midst of a look at the bed that takes its time.
TEST_F(CalibrateLaserUnhomed, ATaskThatWasCancelledHomesNothing) {
  const TaskReporter task = cell->tasks.start("calibrate laser", "looking at the bed");
  ASSERT_TRUE(cell->tasks.cancel(task.id()).ok());
  bool homed = false;
  when_homed(*cell->runner, *cell->runner, task, "uid 1000", [&homed] { homed = true; });
  reactor.restart(), reactor.poll();
  EXPECT_EQ(cell->tasks.find(task.id())->state, TaskState::kCancelled);
  EXPECT_FALSE(homed);
  expect_nothing_moved();
}

}  // namespace
}  // namespace veneer::daemon
