// The wire between the GRBL driver's core and the simulated controller, on one clock that stands still. It can go wrong
// once, at a byte counted from the start of the job.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/grbl/grbl_core.h"
#include "tests/support/fault_campaign.h"
#include "tests/support/grbl_bench.h"

namespace veneer::tests {

class FaultLink {
 public:
  explicit FaultLink(std::uint64_t seed);

  void connect_and_home();
  // Happens at the after-th byte on its way to (kGarbledAnswer: from) the controller, counted from now.
  void arm(WireFault kind, std::size_t after);
  void run(double seconds, const std::function<bool()>& until = {});
  // Carries what waits, tells what happened.
  void exchange();
  void plug();

  TimePoint now() const { return bench.clock.now(); }
  bool fired() const { return fired_; }
  std::size_t bytes_sent() const { return sent_; }

  template <class Event>
  std::vector<Event> all() const {
    std::vector<Event> found;
    for (const LaserEvent& event : events)
      if (const auto* wanted = std::get_if<Event>(&event)) found.push_back(*wanted);
    return found;
  }
  bool over() const {
    return !all<laser_event::Done>().empty() || !all<laser_event::Aborted>().empty() ||
           !all<laser_event::Failed>().empty();
  }

  sim::GrblBench bench;
  grbl::GrblCore core;
  std::vector<LaserEvent> events;
  std::function<void()> on_step;
  double longest_queue_s = 0;  // as the driver counts

 private:
  struct Parcel {
    TimePoint at;
    std::string bytes;
  };
  void send(std::string bytes);
  std::string damaged(std::string bytes);
  std::string fused_valid(const std::string& bytes, std::size_t from);
  void lose_link();
  TimePoint next_arrival() const;

  std::mt19937_64 random_;
  std::deque<Parcel> to_controller_, to_core_;
  std::optional<WireFault> armed_;
  std::size_t countdown_ = 0, sent_ = 0;
  bool fired_ = false, in_pieces_ = false, cannot_drop_ = false, link_down_ = false;
  bool truncating_ = false;
  TimePoint stalled_until_{};
};

}  // namespace veneer::tests
