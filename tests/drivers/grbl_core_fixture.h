// The core with a script in the place of the controller, and what a controller says in its simplest words.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "drivers/grbl/grbl_core.h"

namespace veneer::grbl {

using namespace std::chrono_literals;

inline constexpr const char* kBanner = "\r\nGrbl 1.1h ['$' for help]\r\n";
inline constexpr const char* kSettings =
    "$13=0\r\n$22=1\r\n$23=0\r\n$27=1.000\r\n$30=1000\r\n$32=1\r\n$100=80\r\n$101=80\r\n$110=24000\r\n$111=24000\r\n"
    "$120=1500\r\n$121=1500\r\n$130=520\r\n$131=380\r\nok\r\n";
inline constexpr const char* kModes = "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n";

class GrblCoreTest : public ::testing::Test {
 protected:
  std::string out() {
    const GrblOutput output = core.take_output();
    closed = closed || output.close;
    std::string all = output.urgent;
    for (const char c : output.bytes)
      if (c != '?') all += c;
    return all;
  }
  std::string say(std::string_view bytes) {
    core.receive(bytes, now);
    return out();
  }
  // Answers nothing.
  std::string wait(Duration time) {
    std::string said;
    const TimePoint end = now + time;
    while (core.next_deadline() <= end) {
      now = std::max(now, core.next_deadline());
      core.tick(now);
      said += out();
    }
    now = end;
    core.tick(now);
    return said + out();
  }
  // Answers each poll with this report.
  std::string wait_in(const std::string& report, Duration time) {
    std::string said;
    for (const TimePoint end = now + time; now < end;) {
      now = std::min(end, std::max(core.next_deadline(), now + 1ms));
      core.tick(now);
      const GrblOutput output = core.take_output();
      said += output.urgent;
      for (const char c : output.bytes) {
        if (c == '?') core.receive(report + "\r\n", now);
        if (c != '?') said += c;
      }
      said += out();
    }
    return said;
  }
  void connect() {
    core.connect(now);
    out();
    say(kBanner);
    wait(250ms);
    say("[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n");
    say(kSettings);
    say(kSettings);
    say(kModes);
    wait_in("<Alarm|MPos:0.000,0.000,0.000|FS:0,0>", 100ms);
  }
  void connect_and_home() {
    connect();
    core.home(now);
    ASSERT_EQ(out(), "$H\n");
    say("ok\r\n");
    wait_in("<Idle|MPos:-1.000,-1.000,0.000|FS:0,0>", 200ms);
    core.take_events();
  }
  // A core stays where it is made: its phases know it.
  void make_core(const GrblOptions& options) {
    std::destroy_at(&core);
    std::construct_at(&core, options);
  }
  template <class Event>
  std::optional<Event> event() {
    for (LaserEvent& e : core.take_events()) events.push_back(std::move(e));
    for (const LaserEvent& e : events)
      if (const auto* wanted = std::get_if<Event>(&e)) return *wanted;
    return std::nullopt;
  }
  static LaserJob line_job() {
    Stroke stroke{PieceId{7},      StrokeRole::kCut,    {point<MachineFrame>(519, 379), point<MachineFrame>(500, 379)},
                  MmPerSecond(15), PowerFraction(0.85), 1};
    return {{stroke}};
  }

  // A job whose modes and feed were understood; its motions are on their way.
  std::string begin_line() {
    core.start(line_job(), now);
    EXPECT_EQ(out(), "G0G17G21G91G94\nG0M4S0\nF900\n$G\n");
    return say("ok\r\nok\r\nok\r\n[GC:G0 G54 G17 G21 G91 G94 M4 M9 T0 F900 S0]\r\nok\r\n");
  }

  GrblCore core;
  TimePoint now{};
  std::vector<LaserEvent> events;
  bool closed = false;
};

}  // namespace veneer::grbl
