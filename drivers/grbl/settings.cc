#include "drivers/grbl/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

namespace veneer::grbl {
namespace {

// The settings' numbers in GRBL 1.1; +0 is x, +1 is y.
enum : int {
  kDirections = 3,
  kJunctionDeviation = 11,
  kArcTolerance = 12,
  kReportInches = 13,
  kHomingEnable = 22,
  kHomingDirections = 23,
  kHomingPullOff = 27,
  kMaxPower = 30,
  kLaserMode = 32,
  kStepsPerMm = 100,
  kMaxRate = 110,
  kAcceleration = 120,
  kTravel = 130,
};

// Stock GRBL keeps machine coordinates in [-travel, 0] whichever corner is home; firmware built with
// HOMING_FORCE_SET_ORIGIN (letter Z) has its zero at home instead.
void place_axis(Axis& axis, bool home_at_minimum, bool zero_at_home, double pull_off) {
  if (zero_at_home) {
    axis.origin_mm = home_at_minimum ? 0 : -axis.travel_mm;
    axis.home_mm = 0;
    return;
  }
  axis.origin_mm = -axis.travel_mm;
  axis.home_mm = home_at_minimum ? -axis.travel_mm + pull_off : -pull_off;
}

struct Likely {
  int number;
  double low, high;
  const char* what;
};
// What lasers of this kind have. A value beyond is possible, but more likely a slip of whoever set it.
constexpr Likely kLikely[] = {
    {kMaxPower, 100, 100000, "full power"},          {kStepsPerMm, 5, 4000, "steps per mm in x"},
    {kStepsPerMm + 1, 5, 4000, "steps per mm in y"}, {kMaxRate, 300, 120000, "mm/min in x"},
    {kMaxRate + 1, 300, 120000, "mm/min in y"},      {kAcceleration, 10, 30000, "mm/s2 in x"},
    {kAcceleration + 1, 10, 30000, "mm/s2 in y"},    {kTravel, 40, 3000, "mm of travel in x"},
    {kTravel + 1, 40, 3000, "mm of travel in y"}};

void keep_off_switch(const Axis& axis, double pull_off, Millimetres& low, Millimetres& high) {
  low = Millimetres(0);
  high = Millimetres(axis.travel_mm);
  const double home = axis.home_mm - axis.origin_mm;
  if (home <= pull_off) low = Millimetres(home);
  if (home >= axis.travel_mm - pull_off) high = Millimetres(home);
}

}  // namespace

Box<MachineFrame> MachineSettings::travel() const {
  Box<MachineFrame> box;
  keep_off_switch(x, pull_off_mm, box.min.x, box.max.x);
  keep_off_switch(y, pull_off_mm, box.min.y, box.max.y);
  return box;
}

WirePoint MachineSettings::to_wire(const Point<MachineFrame>& p) const {
  return {std::llround((p.x.count() + x.origin_mm) * 1000), std::llround((p.y.count() + y.origin_mm) * 1000)};
}

Point<MachineFrame> MachineSettings::from_wire(double x_mm, double y_mm) const {
  return point<MachineFrame>(x_mm - x.origin_mm, y_mm - y.origin_mm);
}

void SettingsReader::banner(const Banner& banner) { banner_ = banner.text; }
void SettingsReader::version(const BuildVersion& version) { version_ = version.text; }
void SettingsReader::firmware(const Firmware& firmware) { firmware_ = firmware.name; }
void SettingsReader::options(const BuildOptions& options) { options_ = options; }

double SettingsReader::value(int number, double otherwise) const {
  const auto found = values_.find(number);
  return found == values_.end() ? otherwise : found->second;
}

std::optional<int> SettingsReader::told_differently() const {
  if (!first_) return std::nullopt;
  const auto [first, second] = std::mismatch(first_->begin(), first_->end(), values_.begin(), values_.end());
  if (first == first_->end() && second == values_.end()) return std::nullopt;
  if (first == first_->end()) return second->first;
  return second == values_.end() ? first->first : std::min(first->first, second->first);
}

// With the text that its owner may have given it ($I=...), which stands behind the version. Nothing of the banner: a
// controller that runs already prints none.
std::string SettingsReader::identity() const {
  std::string words = firmware_.empty() ? version_ : firmware_ + " " + version_;
  for (const int number :
       {static_cast<int>(kDirections), static_cast<int>(kHomingEnable), static_cast<int>(kHomingDirections),
        static_cast<int>(kHomingPullOff), static_cast<int>(kMaxPower), static_cast<int>(kStepsPerMm), kStepsPerMm + 1,
        static_cast<int>(kTravel), kTravel + 1, kTravel + 2})
    if (const auto told = values_.find(number); told != values_.end())
      words += fmt::format(" ${}={:g}", number, told->second);
  return words;
}

Result<MachineSettings> SettingsReader::finish() const {
  MachineSettings s;
  // A controller that was already running prints no banner; it names itself in the answer to $I then.
  s.family = family_of(!banner_.empty() ? banner_ : !firmware_.empty() ? firmware_ : version_);
  const std::string version = version_.substr(0, version_.find('.', version_.find('.') + 1));
  s.firmware =
      banner_.empty() ? fmt::format("{} {}", name_of(s.family), version) : banner_.substr(0, banner_.find(" ["));
  s.identity = identity();
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorCode::kRefused,
                 fmt::format("the laser controller ({}) cannot be used, because {}", s.firmware, what)};
  };
  if (const auto number = told_differently())
    return Error{
        ErrorCode::kDeviceFault,
        fmt::format("the laser controller ({}) told its setting ${} differently when it was asked twice: check "
                    "the cable, then Clear and Reset",
                    s.firmware, *number)};
  for (const int needed :
       std::initializer_list<int>{kHomingEnable, kMaxPower, kLaserMode, kTravel, kTravel + 1, kMaxRate, kMaxRate + 1,
                                  kAcceleration, kAcceleration + 1, kStepsPerMm, kStepsPerMm + 1})
    if (!values_.contains(needed))
      return refuse(fmt::format("it did not tell its setting ${}: check the cable, then Clear and Reset", needed));
  if (value(kLaserMode, 0) != 1) return refuse("laser mode is off: set $32=1 so that the beam goes out at rest");
  if (value(kReportInches, 0) != 0) return refuse("it reports in inches: set $13=0");
  s.receive_bytes = options_.receive_bytes.value_or(128);
  if (s.receive_bytes < 80) return refuse(fmt::format("its receive buffer of {} bytes is too small", s.receive_bytes));
  s.planner_blocks = options_.planner_blocks.value_or(15);
  s.max_power = value(kMaxPower, 0);
  s.homing = (static_cast<unsigned>(value(kHomingEnable, 0)) & 1U) != 0;  // grblHAL keeps more in the other bits
  s.pull_off_mm = value(kHomingPullOff, 1);
  s.junction_deviation_mm = value(kJunctionDeviation, 0.01);
  s.arc_tolerance_mm = value(kArcTolerance, 0.002);
  const auto home_corner = static_cast<unsigned>(value(kHomingDirections, 0));
  const bool zero_at_home = options_.letters.find('Z') != std::string::npos;
  for (int i = 0; i < 2; ++i) {
    Axis& axis = i == 0 ? s.x : s.y;
    axis.travel_mm = value(kTravel + i, 0);
    axis.steps_per_mm = value(kStepsPerMm + i, 0);
    axis.max_rate_mm_s = value(kMaxRate + i, 0) / 60;
    axis.acceleration_mm_s2 = value(kAcceleration + i, 0);
    place_axis(axis, ((home_corner >> i) & 1U) != 0, zero_at_home, s.pull_off_mm);
    if (axis.travel_mm <= 2 * s.pull_off_mm || axis.steps_per_mm <= 0 || axis.max_rate_mm_s <= 0 ||
        axis.acceleration_mm_s2 <= 0)
      return refuse(fmt::format("its steps, rate, acceleration or travel is none: check ${}, ${}, ${} and ${}",
                                kStepsPerMm + i, kMaxRate + i, kAcceleration + i, kTravel + i));
  }
  if (s.max_power < 1) return refuse("its full power is below 1: set $30");
  s.lid_switch = options_.letters.find('+') != std::string::npos || signals_.find('D') != std::string::npos;
  for (const Likely& likely : kLikely)
    if (const double is = value(likely.number, 0); is < likely.low || is > likely.high)
      s.unlikely.push_back(fmt::format("${} = {:g} ({})", likely.number, is, likely.what));
  return s;
}

}  // namespace veneer::grbl
