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

// Numbers beyond GRBL's own, from the families' own lists (grblHAL errors.h, FluidNC Error.h).
constexpr std::array<Meaning, 44> kGrblHalErrors = {{
    {18, "the controller was reset"},
    {19, "a value must be above zero"},
    {39, "a value is out of range"},
    {40, "a tool change is pending"},
    {41, "the spindle is not running"},
    {42, "the wrong plane is selected"},
    {43, "the feed rate is too high"},
    {44, "the speed or power is out of range"},
    {45, "a limit switch is engaged"},
    {46, "homing is required"},
    {47, "the tool is wrong"},
    {48, "two words contradict each other"},
    {49, "the self-test failed"},
    {50, "the emergency stop is pressed"},
    {51, "a motor reports a fault"},
    {52, "the setting's value is out of range"},
    {53, "the setting is switched off"},
    {54, "the retract position is wrong"},
    {55, "the homing setup is impossible"},
    {56, "the coordinate system is locked"},
    {57, "a file's demarcation was not expected"},
    {58, "the auxiliary port is not there"},
    {60, "the SD card does not mount"},
    {61, "a file does not read"},
    {62, "a folder does not open"},
    {63, "a folder does not exist"},
    {64, "no SD card is mounted"},
    {65, "no file system is mounted"},
    {66, "the file system is read-only"},
    {70, "Bluetooth does not start"},
    {71, "an unknown operator in an expression"},
    {72, "a division by zero"},
    {73, "an argument is out of range"},
    {74, "an argument is wrong"},
    {75, "an expression does not read"},
    {76, "an expression has no valid result"},
    {77, "authentication is required"},
    {78, "access is denied"},
    {79, "not allowed after a critical alarm"},
    {80, "flow control works only in macros"},
    {81, "flow control does not read"},
    {82, "flow control is nested too deeply"},
    {83, "flow control is out of memory"},
    {84, "a file does not open"},
}};

constexpr std::array<Meaning, 45> kFluidNcErrors = {{
    {18, "no homing cycle is configured"},
    {19, "single axes cannot be homed"},
    {39, "a parameter is too large"},
    {40, "a control pin is active"},
    {60, "the file system does not mount"},
    {61, "a file does not read"},
    {62, "a folder does not open"},
    {63, "a folder does not exist"},
    {64, "the file is empty"},
    {65, "a file does not exist"},
    {66, "a file does not open"},
    {67, "the file system is busy"},
    {68, "a folder cannot be deleted"},
    {69, "a file cannot be deleted"},
    {70, "a file cannot be renamed"},
    {80, "the setting's number is out of range"},
    {81, "the setting's value is wrong"},
    {82, "a file cannot be created"},
    {83, "the file system cannot be formatted"},
    {90, "a message could not be sent"},
    {100, "the stored settings cannot be written"},
    {101, "the settings memory does not tell its state"},
    {110, "authentication failed"},
    {111, "the end of the line was reached"},
    {112, "the end of the file was reached"},
    {113, "the controller was reset"},
    {114, "there is no data"},
    {120, "another interface is busy"},
    {130, "the jog was cancelled"},
    {150, "a pin is described wrongly"},
    {151, "a setting cannot be changed while it runs"},
    {152, "the configuration is invalid"},
    {160, "an upload failed"},
    {161, "a download failed"},
    {162, "the setting is read-only"},
    {170, "a division by zero"},
    {171, "an argument is wrong"},
    {172, "an expression has no valid result"},
    {173, "an unknown operator in an expression"},
    {174, "an argument is out of range"},
    {175, "an expression does not read"},
    {176, "flow control does not read"},
    {177, "flow control works only in macros"},
    {178, "flow control is out of memory"},
    {179, "flow control is nested too deeply"},
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
  std::string_view meaning = find(kErrors, number);
  if (meaning.empty() && family == Family::kGrblHal) meaning = find(kGrblHalErrors, number);
  if (meaning.empty() && family == Family::kFluidNc) meaning = find(kFluidNcErrors, number);
  return describe("error", number, family, meaning);
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
