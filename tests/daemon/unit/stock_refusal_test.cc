// What keeps a job from being cut before it begins: a real laser and a simulated eye, another laser at the port, a disk
// on which no cut can be booked.
#include <gmock/gmock.h>

#include "daemon/unit/disk_room.h"
#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

class StockRefusal : public JobRunnerTest {
 protected:
  void make_runner_on_disk() {
    may_book_ = [this] { return check_room(free_bytes_); };
    make_runner();
  }
  std::optional<std::uintmax_t> free_bytes_;
};

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

TEST_F(StockRefusal, NoJobIsStartedOnADiskThatIsNearlyFull) {
  make_runner_on_disk();
  ASSERT_TRUE(command(CellCommand::kReset).ok());
  free_bytes_ = 9'999'999;
  const Status refused = start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
  EXPECT_EQ(refused.error().message,
            "the disk is nearly full, and soon no cut can be booked: make room on the disk, then try again");
  EXPECT_EQ(state(), CellState::kIdle);
  EXPECT_THAT(piece_states(), Each(db::PieceState::kReserved));
  free_bytes_ = 10'000'000;
  EXPECT_TRUE(start().ok());
}

// Hours may have passed since Start.
TEST_F(StockRefusal, NoPanelIsBegunOnADiskThatHasFilledUpSince) {
  make_runner_on_disk();
  load_first_panel();
  free_bytes_ = 0;
  const auto begun = starts();
  const Status refused = command(CellCommand::kUnsuspend);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("make room on the disk"));
  EXPECT_EQ(state(), CellState::kSuspended);
  EXPECT_EQ(starts(), begun);
  EXPECT_THAT(piece_states(), Each(db::PieceState::kReserved));
  free_bytes_ = std::nullopt;
  EXPECT_TRUE(command(CellCommand::kUnsuspend).ok()) << "a disk that does not answer refuses nothing";
}

// A disk that hangs can be asked no more: what it said before would refuse for good.
TEST(DiskRoom, IsBelievedForThreeMinutes) {
  ManualClock clock;
  DiskRoom room(clock);
  EXPECT_EQ(room.free_bytes(), std::nullopt) << "nobody has asked yet";
  room.told(7);
  clock.advance(std::chrono::minutes(3));
  EXPECT_EQ(room.free_bytes(), 7U);
  clock.advance(std::chrono::milliseconds(1));
  EXPECT_EQ(room.free_bytes(), std::nullopt);
  EXPECT_TRUE(check_room(room.free_bytes()).ok());
  room.told(0);
  EXPECT_FALSE(check_room(room.free_bytes()).ok()) << "it answers again";
  room.told(std::nullopt);
  EXPECT_EQ(room.free_bytes(), std::nullopt) << "it was asked, and could not say";
}

}  // namespace
}  // namespace veneer::daemon
