// How the lines of a drawing are burnt: one rule for veneerctl, which names layers and colours, and for the daemon,
// which is told of each kind of line. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/drawings/drawing.h"

namespace veneer::planner {

// What is not said is nothing.
struct LineSetting {
  std::optional<double> power;       // of the rated power, 0 to 1
  std::optional<double> speed_mm_s;  // of the beam
  std::optional<int> passes;
  std::optional<bool> air;
};
using NamedSettings = std::map<std::string, LineSetting>;  // by layer or colour

// What `a` says, else what `b` says.
LineSetting first_of(const LineSetting& a, const LineSetting& b);

// Of each line: what its layer or colour (`named`) says counts before what is said for all, and both before what the
// file says. kInvalidArgument: the drawing has none of a name.
Result<std::vector<LineSetting>> settings_of(const Drawing& drawing, const LineSetting& all,
                                             const NamedSettings& named);

// Lines of layers that have a recipe ("cut", "engrave") take its power and speed for what nobody said.
void fill_from_recipes(const Drawing& drawing, const NamedSettings& recipes, std::vector<LineSetting>& settings);

// Layers, or colours without one, of lines whose power or speed nobody says: they must not be burnt.
std::set<std::string> untold(const Drawing& drawing, const std::vector<LineSetting>& settings);

// Lines that are told apart by nothing: of one layer and one colour.
struct DrawnLineKind {
  std::string layer, colour;  // as DrawnLine has them
  std::size_t lines = 0;
  double length_mm = 0;  // of all its lines, once each
};
struct DrawnLineKinds {
  std::vector<DrawnLineKind> kinds;  // in the order in which the drawing has them
  std::vector<std::size_t> of_line;  // which of them each line is
};
DrawnLineKinds kinds_of(const Drawing& drawing);

// How far the lines are moved so that the lower left corner of their extent comes to x and y; not at all where one of
// them is not given.
DrawingPoint move_to_corner(const Drawing& drawing, std::optional<double> x_mm, std::optional<double> y_mm);
// As it is sent to be burnt: to a tenth of a micrometre.
DrawingPoint moved(const DrawingPoint& at, const DrawingPoint& by);

}  // namespace veneer::planner
