// Runs numbered tasks on a few threads; the calling thread is one of them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <stop_token>
#include <thread>
#include <vector>

namespace veneer::planner {

// What PlanOptions::threads and the like mean: 0 is as many as the machine has.
inline int threads_meant(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Calls task(i) once for each i below `count`, in any order, on up to `threads` threads; returns when all are done, or
// once `stop` is requested and the running tasks have returned. `between`, if given, runs on the calling thread after
// each of its own tasks with the number of tasks started so far.
inline void run_parallel(std::size_t count, int threads, const std::stop_token& stop,
                         const std::function<void(std::size_t)>& task,
                         const std::function<void(std::size_t)>& between = {}) {
  std::atomic<std::size_t> next{0};
  const auto work = [&](bool caller) {
    for (std::size_t i = next++; i < count && !stop.stop_requested(); i = next++) {
      task(i);
      if (caller && between) between(std::min(count, next.load()));
    }
  };
  std::vector<std::jthread> helpers;
  for (std::size_t t = 1; t < std::min(count, static_cast<std::size_t>(threads)); ++t)
    helpers.emplace_back(work, false);
  work(true);
}

}  // namespace veneer::planner
