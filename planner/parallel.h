// Runs numbered tasks on a few threads; the calling thread is one of them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <type_traits>
#include <vector>

#include "planner/cancelled.h"

namespace veneer::planner {

// What PlanOptions::threads and the like mean: 0 is as many as the machine has.
inline int threads_meant(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Calls task(i) once for each i below `count`, in any order, on up to `threads` threads, and returns when all that were
// begun are done. A task returns nothing or a Status; after one that is not ok no other begins, and that is the answer.
// kCancelled: a stop was requested, so that some tasks were not called, or heeded it and left their work undone.
// `between`, if given, runs on the calling thread after each of its own tasks with the number of tasks begun so far.
template <class Task>
Status run_parallel(std::size_t count, int threads, const std::stop_token& stop, const Task& task,
                    const std::function<void(std::size_t)>& between = {}) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::mutex failing;
  Status answer;
  const auto call = [&](std::size_t i) {
    if constexpr (std::is_void_v<std::invoke_result_t<const Task&, std::size_t>>) {
      task(i);
    } else if (Status status = task(i); !status.ok()) {
      const std::lock_guard lock(failing);
      if (!failed.exchange(true)) answer = std::move(status);
    }
  };
  const auto work = [&](bool caller) {
    for (std::size_t i = next++; i < count && !stop.stop_requested() && !failed; i = next++) {
      call(i);
      if (caller && between) between(std::min(count, next.load()));
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t t = 1; t < std::min(count, static_cast<std::size_t>(threads)); ++t)
      helpers.emplace_back(work, false);
    work(true);
  }
  return stop.stop_requested() ? Status(cancelled()) : answer;
}

}  // namespace veneer::planner
