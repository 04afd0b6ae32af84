// When the cell gives up the pictures that it keeps in memory: not while a STOP might have to wait for that.
#include <future>

#include "tests/support/routed_cell.h"

namespace veneer::daemon {
namespace {

using KeptPicturesTest = testing::RoutedCell;

TEST_F(KeptPicturesTest, StayWhileSomethingMoves) {
  std::promise<void> go;
  cell->database->async([wait = go.get_future().share()](Repositories&) { return wait.wait(), 0; }, [](int) {});
  cell->runner->command(CellCommand::kReset, "test", [](const Status&) {}, {});
  ASSERT_EQ(cell->runner->view().state, CellState::kResetting);
  EXPECT_FALSE(cell->give_up_pictures());
  go.set_value();
  reactor.restart();
  while (cell->runner->view().state == CellState::kResetting && reactor.run_one_for(std::chrono::seconds(60)) > 0) {
  }
  ASSERT_EQ(cell->runner->view().state, CellState::kIdle) << cell->runner->view().reason;
  // The keeper may have small files to write, and is asked again then.
  bool taken = false;
  while (!(taken = cell->give_up_pictures()) && reactor.run_one_for(std::chrono::seconds(60)) > 0) {
  }
  EXPECT_TRUE(taken);
}

}  // namespace
}  // namespace veneer::daemon
