#include "drivers/sim/grbl_controller/settings.h"

#include <fmt/format.h>

namespace veneer::sim {
namespace {

// Settings that GRBL keeps as bytes and prints without decimals.
bool is_integer(int number) {
  switch (number) {
    case 11:
    case 12:
    case 24:
    case 25:
    case 27:
    case 30:
    case 31:
      return false;
    default:
      return number < 100;
  }
}

}  // namespace

GrblSettings GrblSettings::laser_cutter(double travel_x_mm, double travel_y_mm) {
  GrblSettings s;
  s.values = {{0, 10},
              {1, 255},
              {2, 0},
              {3, 0},
              {4, 0},
              {5, 0},
              {6, 0},
              {10, 3},
              {11, 0.010},
              {12, 0.002},
              {13, 0},
              {20, 1},
              {21, 0},
              {22, 1},
              {23, 0},
              {24, 100},
              {25, 6000},
              {26, 250},
              {27, 1},
              {30, 1000},
              {31, 0},
              {32, 1},
              {100, 80},
              {101, 80},
              {102, 80},
              {110, 24000},
              {111, 24000},
              {112, 24000},
              {120, 1500},
              {121, 1500},
              {122, 1500},
              {130, travel_x_mm},
              {131, travel_y_mm},
              {132, 50}};
  return s;
}

double GrblSettings::operator[](int number) const {
  const auto at = values.find(number);
  return at == values.end() ? 0 : at->second;
}

int GrblSettings::set(int number, double value) {
  const auto at = values.find(number);
  if (at == values.end()) return 3;
  if (value < 0) return 4;
  if (number == 0 && value < 3) return 6;
  at->second = is_integer(number) ? static_cast<int>(value) : value;
  return 0;
}

std::string GrblSettings::listing() const {
  std::string out;
  for (const auto& [number, value] : values)
    out += is_integer(number) ? fmt::format("${}={:.0f}\r\n", number, value)
                              : fmt::format("${}={:.3f}\r\n", number, value);
  return out;
}

}  // namespace veneer::sim
