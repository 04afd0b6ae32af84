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

}  // namespace
}  // namespace veneer::daemon
