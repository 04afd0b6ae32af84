// A run whose first piece of two is being burnt, for tests of what its proofs are worth.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace veneer::daemon {

class ProofTest : public JobRunnerTest {
 protected:
  void SetUp() override {
    JobRunnerTest::SetUp();
    laser_.burn_at_once = false;
  }
  // The first piece of two is being burnt.
  void begin() {
    load_first_panel();
    ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
    ASSERT_EQ(starts(), 1);
  }
  // The head is seen to go from x to x along y = 2 of the machine, each known to 1 mm.
  void go_astray(double from, double to) {
    laser_.fail({ErrorCode::kDeviceFault, "the laser is off its path"},
                {point<MachineFrame>(from, 2), point<MachineFrame>(to, 2)}, Millimetres(1));
    settle();
  }
  std::vector<db::AllocationRecord> live(const char* panel = "P-0001") {
    auto found = database_->call([&](Repositories& r) { return r.ledger.live_allocations(PanelId{panel}); });
    return *found;
  }
};

}  // namespace veneer::daemon
