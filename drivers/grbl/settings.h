// What was read from the controller at connect ($I and $$), and what follows from it: travel, the sign of machine
// coordinates, power scale, speeds. Nothing is assumed that can be read.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "drivers/grbl/fault_text.h"
#include "drivers/grbl/reply.h"

namespace veneer::grbl {

// A place in the controller's own machine coordinates, whole micrometres.
using WirePoint = MicroPoint;

struct Axis {
  double travel_mm = 0;
  double steps_per_mm = 0;
  double max_rate_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double origin_mm = 0;  // wire coordinate of machine 0
  double home_mm = 0;    // wire coordinate after homing
};

struct MachineSettings {
  Family family = Family::kGrbl;
  std::string firmware;  // "Grbl 1.1h"
  std::string identity;  // LaserLimits::identity
  std::size_t receive_bytes = 128;
  std::size_t planner_blocks = 15;
  double max_power = 1000;  // S at full power
  bool homing = false;
  double pull_off_mm = 0;
  double junction_deviation_mm = 0.01;  // $11
  double arc_tolerance_mm = 0.002;      // $12, between an arc and its chords
  bool lid_switch = false;              // an input for the safety door is there
  std::vector<std::string> unlikely;    // settings an operator must confirm: LaserLimits::to_confirm
  Axis x, y;

  // Where strokes may lie: the travel without the pull-off at the switches.
  Box<MachineFrame> travel() const;
  // Of a machine without switches: its lower left corner is at this place on the wire.
  void put_corner(double x_mm, double y_mm) {
    x.origin_mm = x.home_mm = x_mm;
    y.origin_mm = y.home_mm = y_mm;
  }
  // Rounded to whole micrometres once, from the absolute place, so that errors do not add up along a path.
  WirePoint to_wire(const Point<MachineFrame>& p) const;
  Point<MachineFrame> from_wire(double x_mm, double y_mm) const;
};

// Collects the answers to $I and $$.
class SettingsReader {
 public:
  void banner(const Banner& banner);
  void version(const BuildVersion& version);
  void firmware(const Firmware& firmware);
  void options(const BuildOptions& options);
  void signals(const Signals& signals) { signals_ = signals.letters; }
  void setting(const SettingLine& line) { values_[line.number] = line.value; }
  // $$ is read twice: a digit that is lost or changed on the way leaves a value that looks as good as the true one.
  void read_again() { first_ = std::exchange(values_, {}); }
  // kRefused for a controller that cannot be used as it is set, with the setting to change.
  Result<MachineSettings> finish() const;

 private:
  double value(int number, double otherwise) const;
  // The first setting that the two answers do not agree on; a line that only one of them had counts.
  std::optional<int> told_differently() const;
  std::string identity() const;
  std::map<int, double> values_;
  std::optional<std::map<int, double>> first_;
  std::string signals_, banner_, version_, firmware_;
  BuildOptions options_;
};

}  // namespace veneer::grbl
