#include "planner/cutting/calibration_pattern.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

namespace veneer::planner {
namespace {

constexpr double kRing = 4, kKeyRing = 8, kLineLength = 20, kClear = 5;
constexpr double kPatternMargin = 6;  // from the centres of outer rings to the area's edge
constexpr std::array<double, 4> kLineOffsets = {-10.5, -4.5, 2.5, 10.5};
// A cell must hold the lines, the clearance on both sides, and the rings at its corners.
constexpr double kLeastPitch = 2 * kLineOffsets.back() + 2 * kClear + kRing;
constexpr double kEvenPitch = 40, kUnevenPitch = 24;
constexpr double kLeastUneven = 14;  // two rings with room between them, one of them a key
constexpr double kPatternFlatness = 0.002;

// The columns, or rows, of an even lattice, from 0 to `length`.
std::vector<double> even_places(double length) {
  const int wished = std::max(1, static_cast<int>(std::lround(length / kEvenPitch)));
  const int cells = std::min(wished, static_cast<int>(std::floor(length / kLeastPitch)));
  std::vector<double> places;
  for (int i = 0; cells > 0 && i <= cells; ++i) places.push_back(i * length / cells);
  return places;
}

int first_line_cell(int columns) { return (columns - 2) / 2; }

// The same of an uneven one, whose cells `holds_lines` are wide enough for the kerf lines.
std::vector<double> uneven_places(double length, const std::function<bool(int cell, int cells)>& holds_lines) {
  constexpr double kGolden = 0.6180339887498949, kLeastShare = 0.05;
  for (int cells = static_cast<int>(std::lround(length / kUnevenPitch)); cells >= 2; --cells) {
    std::vector<double> least, share;
    for (int cell = 0; cell < cells; ++cell) {
      least.push_back(holds_lines(cell, cells) ? kLeastPitch : kLeastUneven);
      share.push_back(kLeastShare + std::fmod(cell * kGolden, 1.0));
    }
    const double over = length - std::accumulate(least.begin(), least.end(), 0.0);
    if (over < 0) continue;
    const double shares = std::accumulate(share.begin(), share.end(), 0.0);
    std::vector<double> places = {0};
    for (std::size_t i = 0; i < least.size(); ++i)
      places.push_back(places.back() + least[i] + over * share[i] / shares);
    places.back() = length;
    return places;
  }
  return {};
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

Result<CalibrationPattern> make_pattern(const PatternLayout& layout) {
  const double width = layout.area.empty() ? 0 : layout.area.width().count() - 2 * kPatternMargin;
  const double height = layout.area.empty() ? 0 : layout.area.height().count() - 2 * kPatternMargin;
  const bool even = layout.spacing == RingSpacing::kEven;
  // Even ones are read only, whatever their size: nothing is burnt that would be refused afterwards.
  if (!even && (width <= kLeastRingSpan.count() || height <= kLeastRingSpan.count()))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("the rings of the calibration pattern must span more than {:.0f} mm both ways, and here "
                             "they would span {:.0f} x {:.0f} mm: lay a larger board on the bed",
                             kLeastRingSpan.count(), std::max(0.0, width), std::max(0.0, height))};
  const auto across = even ? even_places(width) : uneven_places(width, [](int cell, int cells) {
    const int lines = first_line_cell(cells + 1);
    return cell == lines || cell == lines + 1;
  });
  const auto up = even ? even_places(height) : uneven_places(height, [](int cell, int) { return cell == 0; });
  const int columns = static_cast<int>(across.size()), rows = static_cast<int>(up.size());
  if (columns < 3 || rows < 3)
    return Error{ErrorCode::kInvalidArgument,
                 "the calibration pattern needs at least 3 by 3 rings: lay a larger board on the bed"};
  CalibrationPattern pattern{columns, rows, {}, {}};
  const double x0 = layout.area.min.x.count() + kPatternMargin, y0 = layout.area.min.y.count() + kPatternMargin;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool key = (row == 0 && (column == 0 || column == columns - 1)) || (row == rows - 1 && column == 1);
      pattern.rings.push_back(
          {point<MachineFrame>(x0 + across[static_cast<std::size_t>(column)], y0 + up[static_cast<std::size_t>(row)]),
           Millimetres(key ? kKeyRing : kRing)});
    }
  }
  const auto cell = static_cast<std::size_t>(first_line_cell(columns));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const bool along_x = axis == 0;
    const double cx = x0 + (across[cell + axis] + across[cell + axis + 1]) / 2, cy = y0 + up[1] / 2;
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
