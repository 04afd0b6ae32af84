#include "planner/drawings/drawing.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {

DrawingExtent extent_of(const Drawing& drawing) {
  DrawingExtent e{1e300, 1e300, -1e300, -1e300};
  for (const DrawnLine& line : drawing.lines)
    for (const auto& [x, y] : line.points) {
      e.min_x = std::min(e.min_x, x), e.max_x = std::max(e.max_x, x);
      e.min_y = std::min(e.min_y, y), e.max_y = std::max(e.max_y, y);
    }
  return e;
}

std::size_t points_of(const Drawing& drawing) {
  std::size_t count = 0;
  for (const DrawnLine& line : drawing.lines) count += line.points.size();
  return count;
}

double length_of(const Drawing& drawing) {
  double length = 0;
  for (const DrawnLine& line : drawing.lines)
    for (std::size_t i = 1; i < line.points.size(); ++i)
      length += std::hypot(line.points[i][0] - line.points[i - 1][0], line.points[i][1] - line.points[i - 1][1]);
  return length;
}

bool is_finite(const Drawing& drawing) {
  return std::ranges::all_of(drawing.lines, [](const DrawnLine& line) {
    return std::ranges::all_of(line.points,
                               [](const DrawingPoint& p) { return std::isfinite(p[0]) && std::isfinite(p[1]); });
  });
}

}  // namespace veneer::planner
