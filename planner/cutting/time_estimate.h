// How long the machine takes, from accelerations and junction deviation: a model of a GRBL-class controller of its own,
// sharing nothing with the simulator that it is measured against.
//
// Curves count as the short lines they are given as; a controller makes about as many chords of an arc.
// Every piece begins and ends at rest. Between them the controller looks ahead over as many moves as its planner holds
// and the driver queues; a corner is taken at the speed at which a circle through it, `junction_deviation` off its tip,
// needs no more than the acceleration. Pure functions; thread-safe.
#pragma once

#include <chrono>
#include <span>

#include "base/stroke.h"

namespace veneer::planner {

// What of the machine the estimate needs. GRBL's settings $110, $111, $120, $121, $11.
struct Kinematics {
  MmPerSecond rapid_x{400}, rapid_y{400};
  MmPerSecond2 acceleration_x{1500}, acceleration_y{1500};
  Millimetres junction_deviation{0.01};
  int planner_moves = 15;
  // The driver: the longest motion it queues, the longest single move it sends, and what a piece's end costs until it
  // is verified.
  std::chrono::duration<double> queued{0.8}, longest_move{0.2}, drain{0.25};
};

// From rest at `from` through the strokes of one piece, to rest and verified.
std::chrono::duration<double> estimate_piece(std::span<const StrokeIn<BedFrame>> strokes, Point<BedFrame> from,
                                             const Kinematics& kinematics);

}  // namespace veneer::planner
