// One thread of the daemon that does one kind of slow work, in order: it writes the database or a backup, hashes
// passwords, or waits for a device or for a worker process (worker_processes.h). Elsewhere only that process is called
// a worker.
//
// Work that throws costs itself, never the thread or the process: out of memory in the middle of a cut must not end the
// program that owns the laser.
//
// Thread-safe: post() and call() from any thread. call() must not be used from the reactor (it waits) nor from the
// worker itself. The destructor finishes what was posted and joins.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <limits>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <type_traits>

#include "base/result.h"

namespace veneer::daemon {

// Of the exception that is being handled, as one sentence: kUnavailable when memory ran out, else kInternal.
Error error_of_exception() noexcept;

// What `work` returns; when it throws and its result can be an Error, that error.
template <class F>
std::invoke_result_t<F> caught(F&& work) {
  if constexpr (std::is_constructible_v<std::invoke_result_t<F>, Error>) {
    try {
      return work();
    } catch (...) {
      return error_of_exception();
    }
  } else {
    return work();
  }
}

// How much may be posted and not begun.
struct WaitingRoom {
  std::size_t works;
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
};

class Worker {
 public:
  // `nice` lowers the thread's priority (0 to 19). The name is what `top -H` shows, at most 15 characters.
  explicit Worker(std::string name, int nice = 0);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // `failed` is called on this thread with what `work` threw. Without it the exception is dropped, and whoever waits
  // learns of it by what `work` held being destroyed (TaskReporter).
  void post(std::function<void()> work, std::function<void(const Error&)> failed = {});
  // The same when there is room, else false, and nothing is taken. `bytes` is the memory that `work` holds while it
  // waits.
  [[nodiscard]] bool try_post(WaitingRoom room, std::function<void()> work,
                              std::function<void(const Error&)> failed = {}, std::size_t bytes = 0);
  // Work that is done only while nothing else is to be: taken when nothing but its like is under way and nothing waits,
  // else false. Its token is stopped as soon as anything else is posted, which then waits for what it cannot break off.
  [[nodiscard]] bool try_post_giving_way(std::function<void(const std::stop_token&)> work);
  // Whether try_post() would take it now.
  bool has_room(WaitingRoom room, std::size_t bytes = 0) const;

  // What `work` throws comes back as its error where its result can be one, else as the exception.
  template <class F>
  std::invoke_result_t<F> call(F work) {
    std::promise<std::invoke_result_t<F>> done;
    auto result = done.get_future();
    post([&] {
      try {
        if constexpr (std::is_void_v<std::invoke_result_t<F>>) {
          work();
          done.set_value();
        } else {
          done.set_value(caught(work));
        }
      } catch (...) {
        done.set_exception(std::current_exception());
      }
    });
    return result.get();
  }

 private:
  struct Posted {
    std::function<void()> work;
    std::function<void(const Error&)> failed;
    std::size_t bytes = 0;
  };
  bool fits(WaitingRoom room, std::size_t bytes) const;
  std::stop_source what_gives_way();
  void run(const std::string& name, int nice);

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Posted> queue_;                      // guarded by mutex_
  std::size_t waiting_bytes_ = 0;                 // of queue_; guarded by mutex_
  bool busy_ = false;                             // with work that does not give way; guarded by mutex_
  std::stop_source gives_way_{std::nostopstate};  // of the last work that gives way; guarded by mutex_
  bool stopping_ = false;                         // guarded by mutex_
  std::thread thread_;
};

}  // namespace veneer::daemon
