// Curves that somebody drew over a picture, for the cells of a mosaic to lie along: in a drawing, and in one parameter
// of a plan. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "planner/drawings/drawing.h"

namespace veneer::planner {

// Ten-thousandths of the picture's sides from its upper left corner, +x right, +y down; beyond them it lies beside the
// picture.
struct FlowPoint {
  int x = 0, y = 0;
  friend bool operator==(const FlowPoint&, const FlowPoint&) = default;
};
inline constexpr int kWholeSide = 10000;  // of the picture, in a FlowPoint's units
using FlowLine = std::vector<FlowPoint>;  // straight from point to point, of which there are two or more

inline constexpr std::size_t kMostFlowPoints = 600;  // of all lines together: they are one parameter of a request

// X,Y separated by blanks, lines by semicolons: "0,5000 5000,4000 10000,5000;2000,0 2000,10000"; "": none.
// kInvalidArgument: `name` must be such a list.
Result<std::vector<FlowLine>> flow_lines_of(std::string_view name, std::string_view text);
std::string flow_text(const std::vector<FlowLine>& lines);

// All lines of a drawing, whose page is stretched over the picture; without the points that change nothing which is
// wider than a thousandth of a side. kInvalidArgument: it has no page, no line on it, or more than kMostFlowPoints.
Result<std::vector<FlowLine>> flow_lines_of_drawing(const Drawing& drawing);

}  // namespace veneer::planner
