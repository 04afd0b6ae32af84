#include "drivers/grbl/fault_text.h"

#include <fmt/format.h>

#include <array>

namespace veneer::grbl {
namespace {

struct Meaning {
  int number;
  std::string_view text;
};

// Shared by all families: what GRBL 1.1 itself defines.
constexpr std::array<Meaning, 36> kErrors = {{
    {1, "a word does not start with a letter"},
    {2, "a number does not read"},
    {3, "an unknown $ command"},
    {4, "a value is negative"},
    {5, "homing is switched off"},
    {6, "the step pulse is too short"},
    {7, "the stored settings do not read"},
    {8, "the command needs an idle machine"},
    {9, "locked by an alarm or a jog"},
    {10, "soft limits need homing"},
    {11, "the line is too long"},
    {12, "the step rate is too high"},
    {13, "the door is open"},
    {14, "the stored line is too long"},
    {15, "the jog leaves the travel"},
    {16, "the jog command is wrong"},
    {17, "laser mode needs a variable spindle"},
    {20, "an unsupported command"},
    {21, "two commands of one group"},
    {22, "no feed rate given"},
    {23, "a whole number is needed"},
    {24, "two commands want the axis words"},
    {25, "a word is repeated"},
    {26, "axis words are missing"},
    {27, "the line number is wrong"},
    {28, "a value is missing"},
    {29, "an unsupported coordinate system"},
    {30, "G53 needs G0 or G1"},
    {31, "axis words that nothing uses"},
    {32, "an arc without axis words"},
    {33, "the target of the motion is wrong"},
    {34, "the radius of the arc is wrong"},
    {35, "an arc without offsets"},
    {36, "words that nothing uses"},
    {37, "the tool offset has a wrong axis"},
    {38, "the tool number is too large"},
}};

constexpr std::array<Meaning, 9> kAlarms = {{
    {1, "a limit switch was hit"},
    {2, "the target lies outside the soft limits"},
    {3, "reset while moving"},
    {4, "the probe is not in its starting state"},
    {5, "the probe made no contact"},
    {6, "reset while homing"},
    {7, "the door opened while homing"},
    {8, "the limit switch did not release"},
    {9, "no limit switch was found while homing"},
}};

constexpr std::array<Meaning, 1> kGrblAlarms = {{{10, "the second limit switch of a double axis was not found"}}};

constexpr std::array<Meaning, 13> kGrblHalAlarms = {{
    {10, "the emergency stop is pressed"},
    {11, "homing is required"},
    {12, "a limit switch is engaged"},
    {13, "the probe is protected"},
    {14, "the spindle did not reach its speed"},
    {15, "squaring failed"},
    {16, "the self-test failed"},
    {17, "a motor reports a fault"},
    {18, "homing failed"},
    {19, "Modbus failed"},
    {20, "an I/O expander failed"},
    {21, "the settings memory failed"},
    {22, "a buffer overflowed"},
}};

constexpr std::array<Meaning, 9> kFluidNcAlarms = {{
    {10, "the spindle does not answer"},
    {11, "a control pin is active at start"},
    {12, "a limit switch is ambiguous"},
    {13, "hard stop"},
    {14, "not homed"},
    {15, "initialisation failed"},
    {16, "an I/O expander was reset"},
    {17, "a G-code error"},
    {18, "the probe hit a hard limit"},
}};

template <std::size_t N>
std::string_view find(const std::array<Meaning, N>& table, int number) {
  for (const Meaning& meaning : table)
    if (meaning.number == number) return meaning.text;
  return {};
}

std::string describe(std::string_view kind, int number, Family family, std::string_view meaning) {
  return fmt::format("{}:{} of {} ({})", kind, number, name_of(family),
                     meaning.empty() ? "see the firmware's manual" : meaning);
}

}  // namespace

Family family_of(std::string_view banner) {
  if (banner.find("FluidNC") != std::string_view::npos) return Family::kFluidNc;
  if (banner.substr(0, 7) == "GrblHAL" || banner.substr(0, 7) == "grblHAL") return Family::kGrblHal;
  return Family::kGrbl;
}

std::string_view name_of(Family family) {
  switch (family) {
    case Family::kGrbl:
      return "Grbl";
    case Family::kGrblHal:
      return "grblHAL";
    case Family::kFluidNc:
      return "FluidNC";
  }
  return "Grbl";
}

std::string describe_error(int number, Family family) {
  return describe("error", number, family, find(kErrors, number));
}

std::string describe_alarm(int number, Family family) {
  std::string_view meaning = find(kAlarms, number);
  if (meaning.empty()) {
    switch (family) {
      case Family::kGrbl:
        meaning = find(kGrblAlarms, number);
        break;
      case Family::kGrblHal:
        meaning = find(kGrblHalAlarms, number);
        break;
      case Family::kFluidNc:
        meaning = find(kFluidNcAlarms, number);
        break;
    }
  }
  return describe("ALARM", number, family, meaning);
}

}  // namespace veneer::grbl
