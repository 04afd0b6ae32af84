#include "daemon/threads/thread_priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <future>
#include <thread>

#include "daemon/threads/worker.h"

namespace veneer::daemon {
namespace {

int nice_of_this_thread() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid))); }

// What the loop starts while it goes first, a worker among them, has its own place all the same.
TEST(ThreadPriority, IsThatOfOneThreadOnly) {
  const int before = nice_of_this_thread();
  std::jthread loop([before] {
    if (!set_thread_nice(kLoopNice)) {
      EXPECT_EQ(nice_of_this_thread(), before);
      GTEST_SKIP() << "no thread may be raised here";
    }
    EXPECT_EQ(nice_of_this_thread(), kLoopNice);
    for (const int nice : {0, 3}) {
      Worker worker("beside", nice);
      std::promise<int> seen;
      worker.post([&] { seen.set_value(nice_of_this_thread()); });
      EXPECT_EQ(seen.get_future().get(), nice);
    }
  });
  loop.join();
  EXPECT_EQ(nice_of_this_thread(), before);
}

}  // namespace
}  // namespace veneer::daemon
