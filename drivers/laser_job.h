// What a laser is asked to burn.
#pragma once

#include <vector>

#include "base/stroke.h"

namespace veneer {

// Strokes in the order of burning; all strokes of one piece are adjacent, engraving before cutting.
struct LaserJob {
  std::vector<Stroke> strokes;
};

}  // namespace veneer
