// How a material is burnt: from the material's settings and the kerf certificate.
#pragma once

#include "base/units.h"

namespace veneer::planner {

struct Recipe {
  MmPerSecond cut_speed{15};
  PowerFraction cut_power{0.85};
  int cut_passes = 1;
  MmPerSecond engrave_speed{80};
  PowerFraction engrave_power{0.20};
  Millimetres kerf{0.27};  // full width burnt away by a cut
};

// What of the machine the time estimate needs.
struct Kinematics {
  MmPerSecond rapid_speed{400};
  MmPerSecond2 acceleration{1500};
};

}  // namespace veneer::planner
