// A simulated GRBL controller on a bench: a clock that stands still, a sink that keeps every burn.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "drivers/sim/grbl_controller/grbl_controller.h"

namespace veneer::sim {

class GrblBench : public BurnSink {
 public:
  explicit GrblBench(const GrblSettings& settings = GrblSettings::laser_cutter(), const GrblOptions& options = {})
      : controller(settings, options, 7, this) {}

  void burn(const BurnSegment& segment) override { burns.push_back(segment); }

  // Sends and returns all that comes back at once.
  std::string send(std::string_view bytes) {
    controller.receive(bytes, clock.now());
    return controller.take_output();
  }
  std::string wait(double seconds) {
    clock.advance(Duration(static_cast<Duration::rep>(std::llround(seconds * 1e9))));
    controller.advance_to(clock.now());
    return controller.take_output();
  }
  // Runs from event to event until nothing happens by itself any more; returns what was said, and the seconds it took.
  std::string run_out(double* seconds = nullptr) {
    std::string out;
    const TimePoint from = clock.now();
    while (const auto next = controller.next_event_time()) {
      if (*next > clock.now()) clock.advance(*next - clock.now());
      controller.advance_to(clock.now());
      out += controller.take_output();
    }
    if (seconds != nullptr) *seconds = std::chrono::duration<double>(clock.now() - from).count();
    return out;
  }
  void power_on_and_home() {
    controller.power_on(clock.now());
    send("$H\n");
    run_out();
    burns.clear();
  }
  double burnt_mm() const {
    double mm = 0;
    for (const BurnSegment& segment : burns) mm += segment.length_mm();
    return mm;
  }

  ManualClock clock;
  std::vector<BurnSegment> burns;
  GrblController controller;
};

}  // namespace veneer::sim
