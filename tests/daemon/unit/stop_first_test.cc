// STOP, and what stands before the reset byte: nothing that could wait or fail, memory included.
#include <cstdlib>
#include <new>

#include "tests/daemon/unit/job_runner_fixture.h"

namespace {

// Blocks of memory that this thread has asked for.
thread_local std::size_t g_asked_for = 0;

}  // namespace

// Not inlined, or the compiler sees only one of a pair and warns.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_asked_for;
  if (void* block = std::malloc(size > 0 ? size : 1)) return block;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++g_asked_for;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }

namespace veneer::daemon {
namespace {

class StopFirstTest : public JobRunnerTest {};

TEST_F(StopFirstTest, NoMemoryIsAskedForBeforeTheLaserIsTold) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  ASSERT_TRUE(laser_.burning());
  const std::string who = "console link 3 of uid 1000, whose name is longer than a short text";
  std::size_t before = 0, at_abort = 1;
  laser_.on_abort = [&] { at_abort = g_asked_for - before; };
  JobRunner::Reply reply = [](const Status&) {};
  before = g_asked_for;
  runner_->command(CellCommand::kAbort, who, std::move(reply), {});
  EXPECT_EQ(at_abort, 0U);
  EXPECT_TRUE(runner_->view().reason.starts_with("STOP by " + who)) << runner_->view().reason;
  laser_.on_abort = nullptr;
}

TEST_F(StopFirstTest, NobodyAsksWhoStopsBeforeTheLaserIsTold) {
  laser_.burn_at_once = false;
  load_first_panel();
  ASSERT_TRUE(command(CellCommand::kUnsuspend).ok());
  bool told = false, told_when_asked = false;
  laser_.on_abort = [&] { told = true; };
  runner_->stop_by([&] {
    told_when_asked = told;
    return std::string("anonymous");
  });
  EXPECT_TRUE(told_when_asked);
  EXPECT_TRUE(runner_->view().reason.starts_with("STOP by anonymous")) << runner_->view().reason;
  laser_.on_abort = nullptr;
}

}  // namespace
}  // namespace veneer::daemon
