// Streaming a dense engraving to a GRBL controller: 100,000 short segments over a paced serial line.
//
// Figures, all in device time of the simulated controller (its line at the given baud, its planner of 15 blocks):
//   of_limit      what the job would take at the line's rate or, if that is longer, with bytes that cost no time and a
//                 sender that fills the buffer without any care, as a fraction of the time it took
//   lost_percent  the rest of that
//   of_line       the time its bytes need on the line alone, as a fraction of the time it took
//   starved_s     how long the planner stood empty between the first burn and the last
//   driver_cpu    CPU time inside the driver's core, as a fraction of device time: what streaming costs the reactor
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include <boost/asio/io_context.hpp>

#include "base/log.h"
#include "drivers/grbl/grbl_laser.h"
#include "drivers/transport/make_transport.h"
#include "tests/bench/goals.h"
#include "tests/support/grbl_cell.h"
#include "tests/support/pty_controller.h"

namespace veneer {
namespace {

using tests::GrblCell;

constexpr int kSegments = 100000;

// A wavy hatch in one stroke: rows 0.2 mm apart, segments of the given length. `jitter_mm` lays every other point aside
// by as much, which is too rough for arcs: each segment is a line of its own.
LaserJob dense_engraving(double segment_mm, double speed_mm_s, double jitter_mm, int segments = kSegments) {
  Stroke stroke{PieceId{1}, StrokeRole::kEngrave, {}, MmPerSecond(speed_mm_s), PowerFraction(0.3), 1};
  const int per_row = static_cast<int>(300 / segment_mm);
  for (int i = 0; i <= segments; ++i) {
    const int row = i / per_row, along = i % per_row;
    const double x = row % 2 == 0 ? along * segment_mm : (per_row - along) * segment_mm;
    stroke.path.push_back(point<MachineFrame>(60 + x, 40 + row * 0.2 + 0.05 * std::sin(x) + (i % 2) * jitter_mm));
  }
  return {{stroke}};
}

double cpu_s() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

// The same lines, sent as fast as the receive buffer takes them by a sender that looks at nothing else.
double careless_seconds(const LaserJob& job) {
  sim::GrblBench bench;
  bench.power_on_and_home();
  grbl::MachineSettings settings;
  settings.x = settings.y = {520, 80, 400, 1500, -520, -1};
  settings.y.travel_mm = 380;
  settings.y.origin_mm = -380;
  const auto lines = grbl::write_group(job.strokes, 0, settings.to_wire(point<MachineFrame>(519, 379)), settings, 0.2);
  const TimePoint begin = bench.clock.now();
  std::deque<std::size_t> waiting;
  std::size_t in_flight = 0, next = 0;
  while (next < lines.size() || !waiting.empty()) {
    std::string bytes;
    for (; next < lines.size() && in_flight + lines[next].text.size() <= 128; ++next) {
      bytes += lines[next].text;
      in_flight += lines[next].text.size();
      waiting.push_back(lines[next].text.size());
    }
    bench.controller.receive(bytes, bench.clock.now());
    std::string said = bench.controller.take_output();
    if (said.empty()) {
      const auto event = bench.controller.next_event_time();
      if (!event) break;
      if (*event > bench.clock.now()) bench.clock.advance(*event - bench.clock.now());
      bench.controller.advance_to(bench.clock.now());
      said = bench.controller.take_output();
    }
    for (std::size_t at = said.find("ok\r\n"); at != std::string::npos; at = said.find("ok\r\n", at + 4)) {
      in_flight -= waiting.front();
      waiting.pop_front();
    }
  }
  bench.run_out();
  return seconds(bench.clock.now() - begin);
}

void BM_GrblStreamsDenseEngraving(benchmark::State& state) {
  const double segment_mm = static_cast<double>(state.range(0)) / 1000, speed = static_cast<double>(state.range(1));
  const double jitter_mm = static_cast<double>(state.range(2)) / 1000;
  constexpr double kBaud = 115200;
  const LaserJob job = dense_engraving(segment_mm, speed, jitter_mm);
  double took = 0, line = 0, lines = 0, starved = 0, cpu = 0;
  for (auto _ : state) {
    GrblCell cell(sim::GrblSettings::laser_cutter(), {.pace_baud = kBaud});
    cell.connect_and_home();
    cell.sent.clear();
    const TimePoint begin = cell.now();
    TimePoint last = begin, stood{};
    bool begun = false;
    double pauses = 0;
    cell.on_step = [&] {
      const bool moving = cell.bench.controller.moving();
      if (begun && !moving) pauses += seconds(cell.now() - last);
      if (moving) starved += std::exchange(pauses, 0);  // a pause counts once motion has gone on after it
      begun = begun || cell.bench.controller.beam_on();
      last = cell.now();
    };
    cell.core_seconds = [] { return cpu_s(); };
    cell.start(job);
    cell.run(4000, [&] { return cell.over(); });
    if (!cell.has<laser_event::Done>()) state.SkipWithError("the job did not end well");
    took = seconds(cell.now() - begin);
    line = static_cast<double>(cell.sent.size()) * 10 / kBaud;
    lines = static_cast<double>(std::count(cell.sent.begin(), cell.sent.end(), '\n'));
    cpu = cell.core_s;
  }
  const double limit = std::max(line, careless_seconds(job));
  state.counters["device_s"] = took;
  state.counters["lines"] = lines;
  state.counters["of_limit"] = limit / took;
  state.counters["lost_percent"] = 100 * (1 - limit / took);
  state.counters["of_line"] = line / took;
  state.counters["starved_s"] = starved;
  state.counters["driver_cpu"] = cpu / took;
}
// Segments in micrometres, mm/s, jitter in micrometres. At 40 um and 200 mm/s the line is the limit, else the machine
// is.
BENCHMARK(BM_GrblStreamsDenseEngraving)
    ->Args({60, 100, 0})
    ->Args({40, 200, 0})
    ->Args({100, 100, 11})
    ->Args({500, 80, 30})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
// In the machine's own time, which no other program's work makes longer. Where the line is the limit, each byte that
// waits is lost; where the machine is, there is time for it.
const bool kStreams = bench::Goals::all().add({{"BM_GrblStreamsDenseEngraving/40/200/0", "lost_percent", 4, "%"},
                                               {"BM_GrblStreamsDenseEngraving/60/100/0", "lost_percent", 1, "%"},
                                               {"BM_GrblStreamsDenseEngraving/100/100/11", "lost_percent", 1, "%"},
                                               {"BM_GrblStreamsDenseEngraving/500/80/30", "lost_percent", 1, "%"},
                                               {"BM_GrblStreamsDenseEngraving/40/200/0", "starved_s", 0, "s"},
                                               {"BM_GrblStreamsDenseEngraving/60/100/0", "starved_s", 0, "s"},
                                               {"BM_GrblStreamsDenseEngraving/100/100/11", "starved_s", 0, "s"},
                                               {"BM_GrblStreamsDenseEngraving/500/80/30", "starved_s", 0, "s"}});

// The whole driver as the daemon runs it, its reactor, link and timers, in real time over a pseudo-terminal whose other
// end takes bytes at 115200 baud. What streaming costs the daemon:
//   reactor_cpu   CPU time of the reactor's thread, the kernel's share included, as a fraction of real time
void BM_GrblDriverInRealTime(benchmark::State& state) {
  auto settings = sim::GrblSettings::laser_cutter();
  settings.set(24, 20000);
  settings.set(25, 100000);
  settings.set(26, 5);
  tests::PtyController controller(settings, {.pace_baud = 115200});
  const double segment_mm = static_cast<double>(state.range(0)) / 1000;
  const LaserJob job = dense_engraving(segment_mm, 100, 0.004, static_cast<int>(state.range(1)));
  boost::asio::io_context io;
  const SteadyClock clock;
  auto link = make_transport("serial:" + controller.port(), io);
  if (!link) return state.SkipWithError("no pseudo-terminal");
  for (auto _ : state) {
    grbl::GrblLaser laser(std::move(*link), clock, io, make_null_logger());
    bool over = false, well = false;
    double cpu = 0;
    TimePoint begin{};
    std::size_t before = 0;
    laser.connect([&](const LaserEvent& event) {
      if (std::holds_alternative<laser_event::Connected>(event)) return laser.home();
      if (std::holds_alternative<laser_event::Homed>(event)) {
        begin = clock.now();
        cpu = cpu_s();
        before = controller.received().size();
        return laser.start(job);
      }
      well = std::holds_alternative<laser_event::Done>(event);
      over = well || std::holds_alternative<laser_event::Failed>(event) ||
             std::holds_alternative<laser_event::Aborted>(event) || std::holds_alternative<laser_event::Fault>(event);
      if (over) io.stop();
    });
    io.run_for(std::chrono::seconds(120));
    if (!well) return state.SkipWithError("the job did not end well");
    const double took = seconds(clock.now() - begin);
    state.counters["real_s"] = took;
    state.counters["lines_per_s"] = static_cast<double>(job.strokes.front().path.size()) / took;
    state.counters["of_line"] = static_cast<double>(controller.received().size() - before) * 10 / 115200 / took;
    state.counters["reactor_cpu"] = (cpu_s() - cpu) / took;
  }
}
BENCHMARK(BM_GrblDriverInRealTime)->Args({40, 10000})->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace veneer
