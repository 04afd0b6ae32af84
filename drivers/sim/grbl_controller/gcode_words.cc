#include "drivers/sim/grbl_controller/gcode_words.h"

#include <cctype>
#include <cmath>

namespace veneer::sim {
namespace {

// GRBL's numbers: a sign, digits, one point; no exponent.
std::optional<double> read_number(std::string_view line, std::size_t& at) {
  double sign = 1;
  if (at < line.size() && (line[at] == '-' || line[at] == '+')) sign = line[at++] == '-' ? -1 : 1;
  double value = 0;
  double scale = 1;
  int digits = 0;
  bool point = false;
  for (; at < line.size(); ++at) {
    const char c = line[at];
    if (c >= '0' && c <= '9') {
      value = value * 10 + (c - '0');
      if (point) scale *= 10;
      ++digits;
    } else if (c == '.' && !point) {
      point = true;
    } else {
      break;
    }
  }
  if (digits == 0) return std::nullopt;
  return sign * value / scale;
}

int put(std::optional<int>& group, int code) {
  if (group) return 21;
  group = code;
  return 0;
}

}  // namespace

int GcodeInterpreter::read_g(double value, Words& w) {
  // GRBL reads a code to two decimals.
  const auto hundredths = std::lround(value * 100);
  if (hundredths % 10 != 0) return 23;
  const int code = static_cast<int>(hundredths / 10);
  const auto take_axes = [&w](AxisUse use) {
    if (w.axis_use != AxisUse::kNone) return false;
    w.axis_use = use;
    return true;
  };
  switch (code) {
    case 100:
    case 280:
    case 300:
    case 920:
      if (!take_axes(AxisUse::kNonModal)) return 24;
      return put(w.non_modal, code);
    case 40:
    case 530:
    case 281:
    case 301:
    case 921:
      return put(w.non_modal, code);
    case 0:
    case 10:
    case 20:
    case 30:
      if (!take_axes(AxisUse::kMotion)) return 24;
      return put(w.motion, code / 10);
    case 800:
      return put(w.motion, 80);
    case 170:
    case 180:
    case 190:
      return put(w.plane, code / 10);
    case 900:
    case 910:
      return put(w.distance, code / 10);
    case 911:
      return put(w.arc_distance, code);
    case 930:
    case 940:
      return put(w.feed_mode, code / 10);
    case 200:
    case 210:
      return put(w.units, code / 10);
    case 400:
      return put(w.cutter, code);
    case 431:
      if (!take_axes(AxisUse::kToolLength)) return 24;
      return put(w.tool_length, code);
    case 490:
      return put(w.tool_length, code);
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return put(w.system, code / 10 - 54);
    case 610:
      return put(w.control, code);
    default:
      return 20;
  }
}

int GcodeInterpreter::read_m(double value, Words& w) {
  if (std::abs(value - std::trunc(value)) > 0.004) return 23;
  const int code = static_cast<int>(value);
  switch (code) {
    case 0:
    case 1:
    case 2:
    case 30:
      return put(w.flow, code);
    case 3:
    case 4:
    case 5:
      return put(w.spindle, code);
    case 8:
    case 9:
      return put(w.coolant, code);
    default:
      return 20;  // M7 only in builds with mist coolant
  }
}

int GcodeInterpreter::read_words(std::string_view line, bool jog, Words& w) {
  static constexpr std::string_view kValueLetters = "FIJKLNPRSTXYZ";
  for (std::size_t at = 0; at < line.size();) {
    const char letter = line[at++];
    if (letter < 'A' || letter > 'Z') return 1;
    const std::optional<double> number = read_number(line, at);
    if (!number) return 2;
    if (letter == 'G') {
      if (const int error = read_g(*number, w)) return error;
    } else if (letter == 'M') {
      if (jog) return 16;
      if (const int error = read_m(*number, w)) return error;
    } else {
      if (kValueLetters.find(letter) == std::string_view::npos) return 20;
      auto& held = w.values[static_cast<std::size_t>(letter - 'A')];
      if (held) return 25;
      if (*number < 0 && std::string_view("FNPST").find(letter) != std::string_view::npos) return 4;
      held = *number;
    }
  }
  return 0;
}

}  // namespace veneer::sim
