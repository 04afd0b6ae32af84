// What somebody drew: lines in millimetres, +x right, +y up, to be burnt as they are or to bound a picture's pieces.
//
// SVG: paths, lines, polylines, polygons, rectangles, circles and ellipses with all their transforms, as outlines; the
// page's lower left corner is (0, 0). Style sheets are heeded (svg_style.h). What would be burnt otherwise than it
// looks (text, pictures, clones, clips, lengths that do not read) is refused by name. Pure; thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::planner {

using DrawingPoint = std::array<double, 2>;  // mm

struct DrawnLine {
  std::vector<DrawingPoint> points;
  std::string layer;    // the layer's label or the outermost group's id; "" without
  std::string colour;   // of the stroke, "#rrggbb"; "" when none is seen
  bool filled = false;  // so that its inside is seen, closed or not; in an SVG
  // As a file of strokes says; an SVG has none of these.
  std::optional<double> speed_mm_s, power;
  std::optional<int> passes;
  std::optional<bool> air;
};

struct Drawing {
  std::vector<DrawnLine> lines;
  DrawingPoint page{};                // its width and height, of an SVG
  std::vector<std::string> warnings;  // what a person should know of how it was read
};

struct DrawingExtent {
  double min_x = 0, min_y = 0, max_x = 0, max_y = 0;
};
DrawingExtent extent_of(const Drawing& drawing);
std::size_t points_of(const Drawing& drawing);
// Of all lines, once each.
double length_of(const Drawing& drawing);
// Whether every coordinate is a number: what is stretched beyond all measure is none.
bool is_finite(const Drawing& drawing);

// More than any machine burns in a day; a few bytes of a curve may ask for thousands.
inline constexpr std::size_t kMostPoints = 5'000'000;

// kInvalidArgument names what cannot be read, or says that its flattened curves have more points than `most_points`.
Result<Drawing> read_svg(const std::string& text, std::size_t most_points = kMostPoints);

// Curves are flattened to within this.
inline constexpr double kFlatMm = 0.01;

}  // namespace veneer::planner
