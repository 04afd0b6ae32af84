// A stop request in the midst of what a thread is doing.
#pragma once

#include <pthread.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): POSIX

#include <atomic>
#include <cmath>
#include <ctime>
#include <stdexcept>
#include <stop_token>

namespace veneer::planner::test {

// Requests a stop in the midst of what the thread that makes it is doing, after so many seconds of its processor time,
// by a signal: no other thread has to get its turn. One at a time.
class StopInTheMidst {
 public:
  explicit StopInTheMidst(double seconds) {
    current_ = this;
    ::pthread_getcpuclockid(::pthread_self(), &clock_);
    struct sigaction action {};
    action.sa_handler = [](int) {  // only loads, stores and a system call that handlers may make
      current_->stop_.request_stop();
      current_->requested_ = current_->now();
    };
    ::sigaction(SIGUSR1, &action, nullptr);
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL, event.sigev_signo = SIGUSR1;
    if (::timer_create(clock_, &event, &timer_) != 0) throw std::runtime_error("there is no timer");
    itimerspec after{};
    after.it_value.tv_sec = static_cast<time_t>(seconds);
    after.it_value.tv_nsec = static_cast<long>(1e9 * (seconds - std::floor(seconds))) + 1;
    ::timer_settime(timer_, 0, &after, nullptr);
  }
  ~StopInTheMidst() { ::timer_delete(timer_); }
  StopInTheMidst(const StopInTheMidst&) = delete;
  StopInTheMidst& operator=(const StopInTheMidst&) = delete;

  std::stop_token token() const { return stop_.get_token(); }
  // Processor time since the request.
  double spent() const { return stop_.stop_requested() ? now() - requested_ : 0; }
  double now() const {
    timespec time{};
    ::clock_gettime(clock_, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

 private:
  static inline StopInTheMidst* current_ = nullptr;
  std::stop_source stop_;
  clockid_t clock_{};
  timer_t timer_{};
  std::atomic<double> requested_ = 0;
};

}  // namespace veneer::planner::test
