// One thread that does one kind of slow work, in order: scanning, photographing, planning, the database.
//
// Thread-safe: post() and call() from any thread. call() must not be used from the reactor (it waits) nor from the
// worker itself. The destructor finishes what was posted and joins.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <type_traits>

namespace veneer::daemon {

class Worker {
 public:
  // `nice` lowers the thread's priority (0 to 19). The name is what `top -H` shows, at most 15 characters.
  explicit Worker(std::string name, int nice = 0);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void post(std::function<void()> work);

  template <class F>
  std::invoke_result_t<F> call(F work) {
    std::promise<std::invoke_result_t<F>> done;
    auto result = done.get_future();
    post([&] {
      if constexpr (std::is_void_v<std::invoke_result_t<F>>) {
        work();
        done.set_value();
      } else {
        done.set_value(work());
      }
    });
    return result.get();
  }

 private:
  void run(const std::string& name, int nice);

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> queue_;  // guarded by mutex_
  bool stopping_ = false;                    // guarded by mutex_
  std::thread thread_;
};

}  // namespace veneer::daemon
