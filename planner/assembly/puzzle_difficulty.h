// How hard an artwork is to put together without its marks, by the shapes of its pieces alone.
//
// A piece fits into a place in as many ways as it can be turned, face up, until its outline lies within a joint's width
// of the place's everywhere (at 144 points of it, half of their distance allowed for). The difficulty is the mean over
// all pieces of log2 of all ways in all places of its artwork: in bits, what a mark has to tell. A jigsaw of which
// every piece fits one place in one way has 0; a grid of n squares has log2(4 n). Pure; thread-safe.
#pragma once

#include "base/units.h"
#include "planner/plan.h"

namespace veneer::planner {

inline constexpr Millimetres kJoint{0.25};  // what eyes and fingers take for a good fit

// Of one of the plan's artworks, and the mean over the pieces of all; 0 without pieces.
double puzzle_difficulty(const Plan& plan, std::size_t artwork, Millimetres joint = kJoint);
double puzzle_difficulty(const Plan& plan);

}  // namespace veneer::planner
