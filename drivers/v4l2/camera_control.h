// What can be set on a camera, named as v4l2-ctl names it, and what it would take. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace veneer::v4l2 {

struct CameraControl {
  enum class Kind { kYesNo, kWhole, kChoice, kOther };  // kOther: buttons, texts, tables
  std::uint32_t id = 0;                                 // V4L2's
  std::string name;                                     // "exposure_time_absolute"
  Kind kind = Kind::kOther;
  std::int64_t least = 0, most = 0, step = 1;
  std::int64_t usual = 0;  // the device's own default
  std::int64_t value = 0;  // now
  bool active = false;     // it counts as the others are set now
  bool settable = false;
  std::vector<std::pair<std::int64_t, std::string>> choices;  // of kChoice
};

// "Exposure Time, Absolute" is "exposure_time_absolute".
std::string control_name(std::string_view title);
// "3 to 2047", "1 (Manual Mode), 3 (Aperture Priority Mode)", "true or false".
std::string what_it_takes(const CameraControl& control);
// The number of a text that the control takes; kInvalidArgument names what it would take.
Result<std::int64_t> fitting_value(const CameraControl& control, const std::string& wanted, const std::string& camera);
// The one nearest to `value` of those that the control takes. REQUIRES: a kind kWhole.
std::int64_t nearest_value(const CameraControl& control, std::int64_t value);

}  // namespace veneer::v4l2
