#include "daemon/threads/worker.h"

#include <pthread.h>

#include <exception>
#include <limits>
#include <new>

#include "daemon/threads/thread_priority.h"

namespace veneer::daemon {
namespace {

constexpr WaitingRoom kNoLimit{std::numeric_limits<std::size_t>::max()};

// Without memory even a sentence may not fit; then the code must do.
Error sentence(ErrorCode code, const char* before, const char* what, const char* after) noexcept {
  try {
    return {code, std::string(before) + what + after};
  } catch (...) {
    return {code, {}};
  }
}

void do_posted(const std::function<void()>& work, const std::function<void(const Error&)>& failed) noexcept {
  try {
    try {
      work();
    } catch (...) {
      if (failed) failed(error_of_exception());
    }
  } catch (...) {
    // Telling it failed too. Whoever waits is told by the work's end.
  }
}

}  // namespace

Error error_of_exception() noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return sentence(ErrorCode::kUnavailable, "there was not enough memory for this", "",
                    ": wait until other work is done, or ask for something smaller, then try again");
  } catch (const std::exception& e) {
    return sentence(ErrorCode::kInternal, "the work ended with an error of the program (", e.what(),
                    "): try again, and report it when it comes back");
  } catch (...) {
    return sentence(ErrorCode::kInternal, "the work ended with an error of the program", "",
                    ": try again, and report it when it comes back");
  }
}

Worker::Worker(std::string name, int nice) : thread_([this, name = std::move(name), nice] { run(name, nice); }) {}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  what_gives_way().request_stop();
  thread_.join();
}

void Worker::post(std::function<void()> work, std::function<void(const Error&)> failed) {
  static_cast<void>(try_post(kNoLimit, std::move(work), std::move(failed)));
}

bool Worker::fits(WaitingRoom room, std::size_t bytes) const {
  return queue_.size() < room.works && waiting_bytes_ <= room.bytes && bytes <= room.bytes - waiting_bytes_;
}

bool Worker::try_post(WaitingRoom room, std::function<void()> work, std::function<void(const Error&)> failed,
                      std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (!fits(room, bytes)) return false;
    queue_.push_back({std::move(work), std::move(failed), bytes});
    waiting_bytes_ += bytes;
  }
  wake_.notify_one();
  what_gives_way().request_stop();
  return true;
}

// A copy, since whoever waits for its stop is called by request_stop(), and must not find the mutex taken.
std::stop_source Worker::what_gives_way() {
  const std::lock_guard lock(mutex_);
  return gives_way_;
}

bool Worker::try_post_giving_way(std::function<void(const std::stop_token&)> work) {
  {
    const std::lock_guard lock(mutex_);
    if (busy_ || stopping_ || !queue_.empty()) return false;
    if (!gives_way_.stop_possible() || gives_way_.stop_requested()) gives_way_ = std::stop_source();
    const auto begin = [this, work = std::move(work), stop = gives_way_.get_token()] {
      {
        const std::lock_guard begun(mutex_);
        busy_ = false;  // who has heard that it is done may post the next one, though this thread is not back yet
      }
      work(stop);
    };
    queue_.push_back({begin, {}, 0});
  }
  wake_.notify_one();
  return true;
}

bool Worker::has_room(WaitingRoom room, std::size_t bytes) const {
  const std::lock_guard lock(mutex_);
  return fits(room, bytes);
}

void Worker::run(const std::string& name, int nice) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
  // 0 too: who starts it may go before all others. Without the right to it the work is merely less polite.
  set_thread_nice(nice);
  for (;;) {
    Posted next;
    {
      std::unique_lock lock(mutex_);
      busy_ = false;
      wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (queue_.empty()) return;
      next = std::move(queue_.front());
      queue_.pop_front();
      waiting_bytes_ -= next.bytes;
      busy_ = true;
    }
    do_posted(next.work, next.failed);
  }
}

}  // namespace veneer::daemon
