// What a laser is asked to burn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"

namespace veneer {

enum class StrokeRole { kEngrave, kCut, kPattern };

// One path burnt without lifting, with constant programmed power and speed. The beam is dark before its first point.
struct Stroke {
  PieceId piece;  // {0} for strokes that belong to none (calibration pattern)
  StrokeRole role = StrokeRole::kCut;
  Polyline<MachineFrame> path;  // at least two points; a closed cut repeats its first point at the end
  MmPerSecond speed{0};
  PowerFraction power{0};
  int passes = 1;
  bool air = false;  // air assist from the stroke's group (its piece) on; a machine without it takes no notice
  // Of a line of a fill: dark run-up and run-out in the line's direction, so that it is burnt at full speed. Only with
  // one pass. A driver without it burns the line alone.
  Millimetres overscan{0};
};

// Strokes in the order of burning; all strokes of one piece are adjacent, engraving before cutting.
struct LaserJob {
  std::vector<Stroke> strokes;
};

}  // namespace veneer
