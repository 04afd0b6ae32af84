#include "planner/cutting/calibration_pattern.h"

#include <array>
#include <cmath>

namespace veneer::planner {
namespace {

constexpr double kRing = 4, kKeyRing = 8, kLineLength = 20, kClear = 5;
constexpr std::array<double, 4> kLineOffsets = {-10.5, -4.5, 2.5, 10.5};
// A cell must hold the lines, the clearance on both sides, and the rings at its corners.
constexpr double kLeastPitch = 2 * kLineOffsets.back() + 2 * kClear + kRing;
constexpr double kPatternFlatness = 0.002;

int cells_along(double length, double pitch) {
  const int wished = std::max(1, static_cast<int>(std::lround(length / pitch)));
  const int possible = static_cast<int>(std::floor(length / kLeastPitch));
  return std::min(wished, possible);
}

Polyline<MachineFrame> circle(const PatternRing& ring) {
  const double radius = ring.diameter.count() / 2;
  const int sides = static_cast<int>(std::ceil(kPi / std::acos(1 - kPatternFlatness / radius)));
  Polyline<MachineFrame> path;
  for (int i = 0; i <= sides; ++i) {
    const double angle = 2 * kPi * (i % sides) / sides;
    path.push_back(point<MachineFrame>(ring.centre.x.count() + radius * std::cos(angle),
                                       ring.centre.y.count() + radius * std::sin(angle)));
  }
  return path;
}

}  // namespace

Result<CalibrationPattern> make_pattern(const PatternOptions& options) {
  const double margin = options.margin.count();
  const double width = options.area.empty() ? 0 : options.area.width().count() - 2 * margin;
  const double height = options.area.empty() ? 0 : options.area.height().count() - 2 * margin;
  const int columns = cells_along(width, options.pitch.count()) + 1,
            rows = cells_along(height, options.pitch.count()) + 1;
  if (columns < 3 || rows < 3)
    return Error{ErrorCode::kInvalidArgument,
                 "the calibration pattern needs at least 3 by 3 rings: lay a larger board on the bed"};
  CalibrationPattern pattern{columns, rows, {}, {}};
  const double x0 = options.area.min.x.count() + margin, y0 = options.area.min.y.count() + margin;
  const double dx = width / (columns - 1), dy = height / (rows - 1);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool key = (row == 0 && (column == 0 || column == columns - 1)) || (row == rows - 1 && column == 1);
      pattern.rings.push_back(
          {point<MachineFrame>(x0 + column * dx, y0 + row * dy), Millimetres(key ? kKeyRing : kRing)});
    }
  }
  const int cell = (columns - 2) / 2;
  for (int axis = 0; axis < 2; ++axis) {
    const bool along_x = axis == 0;
    const double cx = x0 + (cell + axis + 0.5) * dx, cy = y0 + 0.5 * dy;
    for (const double offset : kLineOffsets) {
      const double h = kLineLength / 2;
      pattern.kerf_lines.push_back(
          along_x ? KerfLine{point<MachineFrame>(cx - h, cy + offset), point<MachineFrame>(cx + h, cy + offset)}
                  : KerfLine{point<MachineFrame>(cx + offset, cy - h), point<MachineFrame>(cx + offset, cy + h)});
    }
  }
  return pattern;
}

std::vector<Stroke> pattern_strokes(const CalibrationPattern& pattern, const Recipe& recipe) {
  std::vector<Stroke> strokes;
  // Rows there and back again keep the dark travel short.
  for (int row = 0; row < pattern.rows; ++row) {
    for (int step = 0; step < pattern.columns; ++step) {
      const int column = row % 2 == 0 ? step : pattern.columns - 1 - step;
      const auto index =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(pattern.columns) + static_cast<std::size_t>(column);
      strokes.push_back(
          {{}, StrokeRole::kPattern, circle(pattern.rings[index]), recipe.engrave_speed, recipe.engrave_power});
    }
  }
  for (const KerfLine& line : pattern.kerf_lines)
    strokes.push_back({{}, StrokeRole::kPattern, {line.from, line.to}, recipe.cut_speed, recipe.cut_power});
  return strokes;
}

}  // namespace veneer::planner
