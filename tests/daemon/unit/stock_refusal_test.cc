// A real laser does not cut stock by a simulated eye.
#include <gmock/gmock.h>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

class StockRefusal : public JobRunnerTest {};

TEST_F(StockRefusal, NoJobIsStartedAndThePiecesStayReserved) {
  options_.stock_refusal = "the laser is a real one, but the camera is simulated";
  make_runner();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  const Status refused = start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("the camera is simulated"));
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_THAT(piece_states(), Each(db::PieceState::kReserved));
}

// What was measured on one machine says nothing of another that is plugged into the same port.
TEST_F(StockRefusal, AnotherLaserAtThePortCutsNothingUntilItIsCalibrated) {
  laser_.identity = "Grbl 1.1h $100=80";
  load_first_panel();
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "the laser is unplugged"}, false});
  settle();
  const auto come_back = [&] {
    ASSERT_TRUE(command(CellCommand::kClear).ok());
    ASSERT_TRUE(command(CellCommand::kReset).ok());
  };
  come_back();
  EXPECT_TRUE(start().ok()) << "it is the same one";
  ASSERT_TRUE(command(CellCommand::kAbort).ok());
  laser_.say(laser_event::Fault{{ErrorCode::kDisconnected, "the laser is unplugged"}, false});
  settle();
  laser_.identity = "Grbl 1.1h $100=160";
  come_back();
  const Status refused = start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("calibrate"));
  EXPECT_EQ(state(), CellState::kIdle);
}

}  // namespace
}  // namespace veneer::daemon
