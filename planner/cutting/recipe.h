// How a material is burnt: its settings, one set for each material.
#pragma once

#include <algorithm>

#include "base/units.h"

namespace veneer::planner {

struct Recipe {
  MmPerSecond cut_speed{15};
  PowerFraction cut_power{0.85};
  int cut_passes = 1;
  MmPerSecond engrave_speed{80};
  PowerFraction engrave_power{0.20};
  int engrave_passes = 1;
  bool air = true, engrave_air = true;  // air assist while cutting, while engraving
  // Full width burnt away by a cut. Pieces are cut from the back: there the kerf is widest, and edges are judged on the
  // show face.
  Millimetres kerf_back{0.27}, kerf_show{0.27};

  Millimetres widest_kerf() const { return std::max(kerf_back, kerf_show); }
};

}  // namespace veneer::planner
