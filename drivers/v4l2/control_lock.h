// A camera as it must be for pictures that can be compared and calibrated: nothing about it changes by itself.
//
// Every automatic that the device has is switched off: exposure, gain, white balance, focus and what steadies the
// picture by moving it; a device that has one on which no program can switch off is refused. What a device does without
// telling of it is not known here. Then each control that changes a picture gets the value that is stated for it, or
// else the device's own default, which is the same after every start and whatever another program left there. Only
// focus must be stated where a motor sets it: a lens calibration is good for one focus, and a default is hardly ever
// sharp. All is read back, and what the device did not take is refused.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "drivers/v4l2/open_camera.h"

namespace veneer::v4l2 {

// By name and text, as the configuration has them.
using StatedControls = std::vector<std::pair<std::string, std::string>>;

struct LockedControls {
  std::vector<std::pair<std::string, std::int64_t>> values;  // by name
  bool motor_moves = false;                                  // one was set elsewhere, and may be on its way still
};

// kInvalidArgument: what is stated cannot be, or is missing; kRefused: the device did not take it.
Result<LockedControls> lock_controls(OpenCamera& camera, const StatedControls& stated);
// kRefused when the device, or another program, has changed one since.
Status still_locked(OpenCamera& camera, const LockedControls& locked);

}  // namespace veneer::v4l2
