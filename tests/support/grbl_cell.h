// The GRBL driver's core on the simulated controller, on one clock that stands still: bytes cross at once, time passes
// from one deadline to the next.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/grbl/grbl_core.h"
#include "tests/support/grbl_bench.h"

namespace veneer::tests {

class GrblCell {
 public:
  explicit GrblCell(const sim::GrblSettings& settings = sim::GrblSettings::laser_cutter(),
                    const sim::GrblOptions& controller_options = {}, const grbl::GrblOptions& options = {})
      : bench(settings, controller_options), core(options) {
    bench.controller.power_on(bench.clock.now());
    bench.controller.take_output();
  }

  void connect() {
    core.connect(now());
    exchange();
    run(5);
  }
  void connect_and_home() {
    connect();
    core.home(now());
    exchange();
    run(120, [this] { return has<laser_event::Homed>() || has<laser_event::Failed>(); });
  }
  void start(LaserJob job) {
    core.start(std::move(job), now());
    exchange();
  }
  bool over() const { return has<laser_event::Done>() || has<laser_event::Aborted>() || has<laser_event::Failed>(); }
  // Until the job is over, and a little longer: late answers must do no harm.
  void run_job(double most_s = 600) {
    run(most_s, [this] { return over(); });
    run(3);
  }

  // Lets time pass until `until` holds or `seconds` are over.
  void run(double seconds, const std::function<bool()>& until = {}) {
    const TimePoint end = now() + Duration(static_cast<Duration::rep>(seconds * 1e9));
    while (now() < end && !(until && until())) {
      TimePoint next = std::min(end, core.next_deadline());
      if (const auto event = bench.controller.next_event_time()) next = std::min(next, *event);
      // Deadlines that are already past are served without time passing.
      if (next > now()) bench.clock.advance(next - now());
      bench.controller.advance_to(now());
      exchange();
      in_core([&] { core.tick(now()); });
      exchange();
      if (next == end) return;
      if (on_step) on_step();
    }
  }

  TimePoint now() const { return bench.clock.now(); }

  template <class Event>
  bool has() const {
    return first<Event>().has_value();
  }
  template <class Event>
  std::optional<Event> first() const {
    for (const LaserEvent& event : events)
      if (const auto* wanted = std::get_if<Event>(&event)) return *wanted;
    return std::nullopt;
  }
  template <class Event>
  std::vector<Event> all() const {
    std::vector<Event> found;
    for (const LaserEvent& event : events)
      if (const auto* wanted = std::get_if<Event>(&event)) found.push_back(*wanted);
    return found;
  }

  void exchange() {
    for (;;) {
      grbl::GrblOutput output;
      in_core([&] { output = core.take_output(); });
      if (on_wire) on_wire(output.bytes);
      if (!output.urgent.empty()) bench.controller.receive(output.urgent, now());
      if (!output.bytes.empty()) bench.controller.receive(output.bytes, now());
      sent += output.urgent + output.bytes;
      longest_queue_s = std::max(longest_queue_s, core.queued_motion_s());
      for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
      const std::string answer = bench.controller.take_output();
      if (answer.empty()) break;
      received += answer;
      in_core([&] { core.receive(answer, now()); });
    }
    for (LaserEvent& event : core.take_events()) events.push_back(std::move(event));
    if (!bench.controller.link_up() && !std::exchange(link_lost, true)) {
      core.link_lost({ErrorCode::kDisconnected, "the link is gone"}, now());
      exchange();
    }
  }

  template <class F>
  void in_core(F work) {
    const double begin = core_seconds ? core_seconds() : 0;
    work();
    if (core_seconds) core_s += core_seconds() - begin;
  }

  sim::GrblBench bench;
  grbl::GrblCore core;
  std::vector<LaserEvent> events;
  std::string sent, received;
  double longest_queue_s = 0;
  bool link_lost = false;
  std::function<double()> core_seconds;  // a clock for the time spent in the core
  double core_s = 0;
  std::function<void()> on_step;
  std::function<void(std::string&)> on_wire;  // may change the bytes on their way to the controller
};

// Squares, each with an engraved line and an engraved circle before its outline: three strokes a piece.
inline LaserJob square_job(int pieces, double side_mm = 12, double x0 = 40, double y0 = 50) {
  LaserJob job;
  for (int i = 0; i < pieces; ++i) {
    const int row = i / 20, column = i % 20;
    const double x = x0 + (side_mm + 2) * column, y = y0 + (side_mm + 2) * row;
    const PieceId piece{i + 1};
    job.strokes.push_back({piece,
                           StrokeRole::kEngrave,
                           {point<MachineFrame>(x + 3, y + 4.3333), point<MachineFrame>(x + 8.12345, y + 5.4321)},
                           MmPerSecond(80),
                           PowerFraction(0.2),
                           1});
    // A round letter: short lines, fast.
    Polyline<MachineFrame> round;
    for (int k = 0; k <= 36; ++k)
      round.push_back(
          point<MachineFrame>(x + 3 + 0.8 * std::cos(k % 36 * kPi / 18), y + 2 + 0.8 * std::sin(k % 36 * kPi / 18)));
    job.strokes.push_back({piece, StrokeRole::kEngrave, round, MmPerSecond(80), PowerFraction(0.2), 1});
    job.strokes.push_back(
        {piece,
         StrokeRole::kCut,
         {point<MachineFrame>(x, y), point<MachineFrame>(x + side_mm, y), point<MachineFrame>(x + side_mm, y + side_mm),
          point<MachineFrame>(x, y + side_mm), point<MachineFrame>(x, y)},
         MmPerSecond(15),
         PowerFraction(0.85),
         1});
  }
  return job;
}

}  // namespace veneer::tests
