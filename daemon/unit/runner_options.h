// What the cell's configuration says to the unit.
#pragma once

#include <string>
#include <vector>

#include "base/units.h"
#include "daemon/unit/preflight.h"

namespace veneer::daemon {

struct RunnerOptions {
  std::vector<std::string> confirm;     // what the operator confirms by name before the beam comes on
  std::vector<KeepOut> keep_out;        // where the head must not go
  Millimetres thickness{0};             // of a panel: where the focus belongs
  MmPerSecond frame_speed{100};         // of the frame, and of the head on its way out of the picture
  PowerFraction frame_max_power{0.03};  // that an operator may ask for
  int look_every = 25;                  // pieces, until the camera looks again; 0 = never, nor before the end
  std::string stock_refusal;            // why no wood from stock may be cut; "" = it may
};

}  // namespace veneer::daemon
