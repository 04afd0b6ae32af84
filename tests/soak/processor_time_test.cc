#include "tests/soak/processor_time.h"

#include <gtest/gtest.h>

#include <ctime>
#include <thread>

namespace veneer::tests {
namespace {

double seconds_of_this_thread() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// As a worker that does its work between two looks and is gone at both.
TEST(ProcessorTimeTest, WhatAThreadHadCountsAfterItsEnd) {
  const auto before = processor_seconds(getpid());
  ASSERT_TRUE(before);
  std::thread([] {
    const double began = seconds_of_this_thread();
    while (seconds_of_this_thread() < began + 0.3) continue;
  }).join();
  const auto after = processor_seconds(getpid());
  ASSERT_TRUE(after);
  EXPECT_GE(*after - *before, 0.3 - 2.0 / static_cast<double>(sysconf(_SC_CLK_TCK))) << "told in whole ticks";
}

TEST(ProcessorTimeTest, NoProcessHasNone) {
  EXPECT_FALSE(processor_seconds(-1));
  EXPECT_TRUE(thread_times(-1).empty());
}

TEST(ProcessorTimeTest, ThreadsAreToldByTheirNames) {
  const auto threads = thread_times(getpid());
  const auto first = threads.find(std::to_string(getpid()));
  ASSERT_NE(first, threads.end());
  EXPECT_EQ(first->second.name, read_processor_time("/proc/self/stat")->name);
}

}  // namespace
}  // namespace veneer::tests
