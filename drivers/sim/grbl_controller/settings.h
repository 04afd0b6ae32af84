// The $-settings of GRBL 1.1h, as far as a laser uses them.
#pragma once

#include <array>
#include <map>
#include <string>

namespace veneer::sim {

struct GrblSettings {
  std::map<int, double> values;  // by number, in the settings' own units: mm, mm/min, mm/s2, 0/1

  // A diode or CO2 cutter of the given travel: homing and soft limits on, laser mode on, S 0..1000.
  static GrblSettings laser_cutter(double travel_x_mm = 520, double travel_y_mm = 380);

  double operator[](int number) const;
  bool flag(int number) const { return (*this)[number] != 0; }
  // 0, or GRBL's error number: 3 for a number that does not exist, 4 for a negative value.
  int set(int number, double value);
  // "$130=520.000\r\n" per setting.
  std::string listing() const;
};

}  // namespace veneer::sim
