// One STOP, from the request to the byte on the wire, as the campaigns measure it.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/soak/percentile.h"
#include "tests/support/laser_only_cell.h"

namespace veneer::tests {

inline double ms_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// A way to say STOP, and the milliseconds it took.
struct StopDoor {
  std::string name;
  std::function<Status()> stop;
  std::vector<double> ms;
};

struct OneStop {
  double ms = -1;      // until the byte was there; < 0 when something failed
  std::string failed;  // what
  std::chrono::steady_clock::time_point asked;
};

template <class T>
Status told_of(const Result<T>& reply) {
  return reply ? Ok() : Status(reply.error());
}

// The daemon, and what its machine truly does.
struct StopMachine {
  LoneDaemon& daemon;
  std::function<bool()> beam_on;
  std::function<std::vector<std::chrono::steady_clock::time_point>()> resets;  // when each was there
  double pattern_mm;  // large enough that the burn lasts longer than the measurement
};

// Most of what a STOP waits for is the dark way to where its burn begins, on which nothing is measured.
inline sim::GrblSettings hasty_laser() {
  sim::GrblSettings settings = LaserOnlyCell::quick_laser();
  for (const int axis : {0, 1}) {
    settings.set(110 + axis, 60000);  // mm/min
    settings.set(120 + axis, 8000);   // mm/s^2
  }
  return settings;
}

inline StopMachine machine_of(LaserOnlyCell& cell) {
  return {cell, [&cell] { return cell.laser.beam_on(); }, [&cell] { return cell.laser.resets(); }, 300};
}

// Burns until the beam is on. What the cell looks at before it homes or burns may come too late beside a crowd: then
// its work ends and says why, and is asked for once more, as an operator would.
inline Status burn(const StopMachine& machine) {
  const LoneDaemon& daemon = machine.daemon;
  Status last = Ok();
  const bool burning = daemon.wait_for([&] {
    const auto begun = daemon.begin_pattern(machine.pattern_mm);
    if (last = told_of(begun); !last) return false;
    const auto is_over = [&] {
      const auto task = daemon.api().get(fmt::format("/tasks/{}", *begun));
      if (!task || (*task)["state"] == "running") return false;
      last = Error{ErrorCode::kRefused, task->dump()};
      return true;
    };
    return daemon.wait_for([&] { return machine.beam_on() || is_over(); }) && machine.beam_on();
  });
  return burning ? Ok() : last;
}

// Burns, says STOP somewhere in the stream, once, waits for the end, Clears.
inline OneStop one_stop(const StopMachine& machine, const StopDoor& door, std::mt19937& random) {
  OneStop out;
  const auto failed = [&out](const std::string& what) {
    out.failed = what;
    return out;
  };
  const LoneDaemon& daemon = machine.daemon;
  if (const Status begun = burn(machine); !begun) return failed("the beam does not come on: " + begun.error().message);
  std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 400));  // anywhere in the stream
  const std::size_t before = machine.resets().size();
  out.asked = std::chrono::steady_clock::now();
  if (const Status told = door.stop(); !told) return failed("STOP was not answered: " + told.error().message);
  if (!daemon.wait_for([&] { return machine.resets().size() > before && daemon.state() == "Aborted"; }))
    return failed("no reset, or not Aborted: " + daemon.state());
  const double ms = ms_between(out.asked, machine.resets()[before]);
  if (!daemon.wait_for([&] { return daemon.api().post("/commands/clear").ok(); })) return failed("Clear is refused");
  out.ms = ms;
  return out;
}

}  // namespace veneer::tests
