// Curves that somebody drew over a picture, for the cells of a mosaic to lie along: in a drawing, and in one parameter
// of a plan. Pure; thread-safe.
#pragma once

#include <cstddef>
#include <optional>
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
// Of a drawing of them, curves as they are flattened (read_svg()): far more than any line needs.
inline constexpr std::size_t kMostDrawnFlowPoints = 100'000;

// Whether any of it lies on the picture, its borders among it: a line may cross it with all its points beside it.
bool meets_picture(const FlowLine& line);

// What one parameter of a plan says: the lines, and the width and height of the page that they were drawn on, in mm;
// none: they were drawn on the picture itself, or nobody noted it.
struct FlowDrawing {
  std::vector<FlowLine> lines;
  std::optional<DrawingPoint> page{};
};

// X,Y separated by blanks, lines by semicolons, the page before a colon: "210x140:0,5000 5000,4000 10000,5000;2000,0
// 2000,10000"; "": none. kInvalidArgument: `name` must be such a list.
Result<FlowDrawing> flow_drawing_of(std::string_view name, std::string_view text);
std::string flow_text(const FlowDrawing& drawing);

// Lines are stretched over the picture with their page, which is to change them little. kInvalidArgument: the page,
// which `named` begins the sentence about, has another shape than so many pixels.
Status check_flow_page(std::string_view named, const DrawingPoint& page, int width, int height);

// All lines of a drawing, whose page is stretched over the picture; without the points that change nothing which is
// wider than a thousandth of a side. kInvalidArgument: it has no page, no line on it, or needs more than
// kMostFlowPoints.
Result<std::vector<FlowLine>> flow_lines_of_drawing(const Drawing& drawing);

}  // namespace veneer::planner
