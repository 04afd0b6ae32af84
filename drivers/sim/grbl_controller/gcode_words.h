// The words of one line of G-code, sorted into modal groups.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/sim/grbl_controller/gcode.h"

namespace veneer::sim {

enum class AxisUse { kNone, kMotion, kNonModal, kToolLength };

// A command of a modal group, or nothing. G codes are held times ten: 28.1 is 281.
struct GcodeInterpreter::Words {
  std::optional<int> motion, non_modal, plane, distance, arc_distance, feed_mode, units, cutter, tool_length, system,
      control, flow, spindle;
  std::optional<int> coolant;
  AxisUse axis_use = AxisUse::kNone;
  std::array<std::optional<double>, 26> values{};
  std::uint32_t used = 0;  // letters of `values` that a command has taken

  const std::optional<double>& value(char letter) const { return values[static_cast<std::size_t>(letter - 'A')]; }
  bool has(char letter) const { return value(letter).has_value(); }
  void use(char letter) { used |= 1U << (letter - 'A'); }
  bool has_axis() const { return has('X') || has('Y') || has('Z'); }
};

}  // namespace veneer::sim
