// Time arrives by constructor. Two clocks exist side by side in the cell: real time (links, watchdogs, people) and
// device time, which `[sim] time_scale` makes run faster than real time when the machine is simulated.
//
// Thread-safe: now() and real_delay() may be called from any thread.
#pragma once

#include <atomic>
#include <chrono>
#include <string>

namespace veneer {

using Duration = std::chrono::nanoseconds;
using TimePoint = std::chrono::time_point<std::chrono::steady_clock, Duration>;

class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const = 0;
  // How long a timer of real time must run so that `device` has passed on this clock.
  virtual Duration real_delay(Duration device) const = 0;
};

// Real time.
class SteadyClock final : public Clock {
 public:
  TimePoint now() const override { return std::chrono::steady_clock::now(); }
  Duration real_delay(Duration device) const override { return device; }
};

// Device time running `scale` times as fast as real time, counted from the steady clock's own origin, so that two
// processes with the same scale agree.
class ScaledClock final : public Clock {
 public:
  explicit ScaledClock(double scale);
  TimePoint now() const override;
  Duration real_delay(Duration device) const override;
  double scale() const { return scale_; }

 private:
  double scale_;
};

// Stands still until told otherwise.
class ManualClock final : public Clock {
 public:
  TimePoint now() const override { return TimePoint(Duration(ns_.load())); }
  Duration real_delay(Duration) const override { return Duration(0); }
  void advance(Duration d) { ns_ += d.count(); }

 private:
  std::atomic<Duration::rep> ns_{0};
};

// Calendar time for records, UTC, ISO 8601 with milliseconds: "2026-05-01T07:30:00.123Z". Never used for timeouts.
// `ahead` of now, for dates of expiry.
std::string utc_timestamp(std::chrono::seconds ahead = std::chrono::seconds(0));
// The same of a moment that somebody else told.
std::string utc_text(std::chrono::system_clock::time_point at);

}  // namespace veneer
