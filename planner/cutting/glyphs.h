// The single-line alphabet of marks: capitals, digits and '-'. A capital is 6 units high and about 4 wide, its baseline
// at y = 0, its left edge at x = 0. Curves are flattened to steps of at most 15 degrees. Immutable; thread-safe.
#pragma once

#include <string_view>
#include <vector>

namespace veneer::planner {

struct GlyphPoint {
  double x = 0, y = 0;
};

struct Glyph {
  std::vector<std::vector<GlyphPoint>> strokes;
  double width = 0;
};

inline constexpr double kGlyphHeight = 6;

// Null for a character the alphabet does not have.
const Glyph* find_glyph(char c);

}  // namespace veneer::planner
