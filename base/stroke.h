// One path of the beam: what toolpaths are made of, and what a laser is asked to burn.
#pragma once

#include "base/geometry.h"
#include "base/ids.h"

namespace veneer {

enum class StrokeRole { kEngrave, kCut, kPattern };

// Burnt without lifting, with constant programmed power and speed. The beam is dark before its first point.
template <class Frame>
struct StrokeIn {
  PieceId piece;  // {0} for strokes that belong to none (calibration pattern)
  StrokeRole role = StrokeRole::kCut;
  Polyline<Frame> path;  // at least two points; a closed one repeats its first point at the end
  MmPerSecond speed{0};
  PowerFraction power{0};
  int passes = 1;    // an open path is burnt back and forth
  bool air = false;  // air assist from the stroke's group (its piece) on; a machine without it takes no notice
  // Of a line of a fill: dark run-up and run-out in the line's direction, so that it is burnt at full speed. Only with
  // one pass. A driver without it burns the line alone.
  Millimetres overscan{0};

  bool closed() const { return path.size() > 2 && distance(path.front(), path.back()).count() < 1e-6; }
  // Where the last pass ends.
  Point<Frame> end() const { return !closed() && passes % 2 == 0 ? path.front() : path.back(); }
};

// As drivers get it.
using Stroke = StrokeIn<MachineFrame>;

}  // namespace veneer
