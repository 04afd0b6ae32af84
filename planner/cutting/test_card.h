// A card burnt into a piece of the wood whose recipe is wanted: a field for every power and speed, one row a power, one
// column a speed, each marked with its per cent and its mm/s.
//
// Geometry, in MachineFrame, the lower left corner of the card at `corner`: rows from the lowest power at the bottom to
// the highest at the top, columns from the slowest speed on the left to the fastest.
//  - kCut: squares of `side`, cut once around. What falls out was cut through. A square that fell out is narrower than
//    drawn by half a kerf on each side, so at either face: kerf = side - what the calipers say.
//  - kEngrave: squares of `side` filled with lines `pitch` apart, in alternating directions, each with a dark run-up
//    and run-out long enough to be burnt at full speed.
// Labels are engraved first, then the fields, the weakest before the strongest. Pure functions; thread-safe.
#pragma once

#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/result.h"
#include "base/stroke.h"
#include "planner/cutting/recipe.h"

namespace veneer::planner {

struct TestCardOptions {
  enum class Operation { kCut, kEngrave } operation = Operation::kCut;
  std::vector<PowerFraction> powers{PowerFraction(0.4), PowerFraction(0.55), PowerFraction(0.7), PowerFraction(0.85),
                                    PowerFraction(1.0)};
  std::vector<MmPerSecond> speeds{MmPerSecond(6), MmPerSecond(10), MmPerSecond(15), MmPerSecond(22), MmPerSecond(30)};
  int passes = 1;  // of a cut
  bool air = true;
  Millimetres side{8};
  Millimetres pitch{0.15};          // of a fill's lines
  MmPerSecond2 acceleration{1500};  // of the machine, for run-ups
  Recipe labels;                    // its engraving writes the labels
  Point<MachineFrame> corner{};
};

struct TestCard {
  std::vector<Stroke> labels, fields;  // in the order of burning, labels first
  Box<MachineFrame> area;              // all of it, run-ups included
};

// kInvalidArgument names what cannot be: 1 to 10 powers and speeds, labels of whole per cent and whole mm/s.
Result<TestCard> make_test_card(const TestCardOptions& options);

// To look at before it is burnt: millimetre units, +y up, labels blue, fields red, the stronger the darker.
std::string test_card_svg(const TestCard& card);

// Parallel lines `pitch` apart that fill the box, in alternating directions, from the bottom up.
std::vector<Polyline<MachineFrame>> fill_lines(const Box<MachineFrame>& box, Millimetres pitch);
// The way the head needs from rest to `speed`, with a tenth to spare.
Millimetres run_up(MmPerSecond speed, MmPerSecond2 acceleration);

}  // namespace veneer::planner
