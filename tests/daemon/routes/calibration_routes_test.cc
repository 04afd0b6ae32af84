// Calibrations as the API begins them, on a cell whose laser is a file.
#include <gmock/gmock.h>

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

}  // namespace
}  // namespace veneer::daemon
