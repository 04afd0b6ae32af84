// A drawing to be burnt as it is: lines in millimetres, +x right, +y up, from an SVG file or from our own JSON of
// strokes.
//
// SVG: paths, lines, polylines, polygons, rectangles, circles and ellipses with all their transforms, as outlines; the
// page's lower left corner is (0, 0). What would be burnt otherwise than it looks (text, pictures, clones, clips) is
// refused by name. JSON: docs/LASER.md, docs/schemas/strokes.schema.json.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace veneer::cli {

using DrawingPoint = std::array<double, 2>;  // mm

struct DrawnLine {
  std::vector<DrawingPoint> points;
  std::string layer;   // the layer's label or the outermost group's id; "" without
  std::string colour;  // of the stroke, "#rrggbb"; "" when it has none
  // As the file says (JSON only).
  std::optional<double> speed_mm_s, power;
  std::optional<int> passes;
  std::optional<bool> air;
};

struct Drawing {
  std::vector<DrawnLine> lines;
  std::vector<std::string> warnings;  // what a person should know of how it was read
};

struct DrawingExtent {
  double min_x = 0, min_y = 0, max_x = 0, max_y = 0;
};
DrawingExtent extent_of(const Drawing& drawing);
std::size_t points_of(const Drawing& drawing);
// Of all lines, once each.
double length_of(const Drawing& drawing);

// By the file's name: .svg, else JSON. kInvalidArgument names what cannot be read.
Result<Drawing> read_drawing(const std::string& name, const std::string& text);
Result<Drawing> read_svg(const std::string& text);
Result<Drawing> read_strokes(const std::string& text);

// Curves are flattened to within this.
inline constexpr double kFlatMm = 0.01;

}  // namespace veneer::cli
