#include "planner/cutting/glyphs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include "base/units.h"

namespace veneer::planner {
namespace {

struct GlyphDrawing {
  char character;
  const char* strokes;  // points "x y"; ";" lifts the beam; "@ cx cy rx ry from to" runs along an ellipse, degrees
};

// Drawn to stay apart when burnt 2 mm high: 0 is narrow and O a full round, 1 has a flag and a foot while I has two
// bars, 5 has a flat roof and a corner where S only curves, 6 and 9 have open arms and stand over a bar.
constexpr std::array<GlyphDrawing, 37> kDrawings = {{
    {'A', "0 0 2 6 4 0; 0.7 2.1 3.3 2.1"},
    {'B', "0 0 0 6 2.3 6 @ 2.3 4.6 1.4 1.4 90 -90 0 3.2; 2.3 3.2 @ 2.4 1.6 1.6 1.6 90 -90 0 0"},
    {'C', "@ 2.2 3 2.2 3 45 315"},
    {'D', "0 0 0 6 1.6 6 @ 1.6 3 2.4 3 90 -90 0 0"},
    {'E', "3.6 6 0 6 0 0 3.6 0; 0 3.1 2.9 3.1"},
    {'F', "3.6 6 0 6 0 0; 0 3.1 2.9 3.1"},
    {'G', "@ 2.2 3 2.2 3 48 330 4.2 2.7 2.5 2.7"},
    {'H', "0 0 0 6; 4 0 4 6; 0 3.1 4 3.1"},
    {'I', "1 0 1 6; 0 6 2 6; 0 0 2 0"},
    {'J', "1.4 6 3.2 6 3.2 1.6 @ 1.6 1.6 1.6 1.6 0 -165"},
    {'K', "0 0 0 6; 3.9 6 0 2.3; 1.4 3.6 4 0"},
    {'L', "0 6 0 0 3.6 0"},
    {'M', "0 0 0 6 2.3 1.4 4.6 6 4.6 0"},
    {'N', "0 0 0 6 4 0 4 6"},
    {'O', "@ 2.5 3 2.5 3 90 450"},
    {'P', "0 0 0 6 2.2 6 @ 2.2 4.4 1.6 1.6 90 -90 0 2.8"},
    {'Q', "@ 2.5 3 2.5 3 90 450; 2.9 1.5 4.7 -0.3"},
    {'R', "0 0 0 6 2.2 6 @ 2.2 4.5 1.5 1.5 90 -90 0 3; 2 3 4 0"},
    {'S', "@ 1.95 4.5 1.7 1.5 30 270 @ 1.95 1.5 1.85 1.5 90 -150"},
    {'T', "2 0 2 6; 0 6 4 6"},
    {'U', "0 6 0 1.9 @ 2 1.9 2 1.9 180 360 4 6"},
    {'V', "0 6 2 0 4 6"},
    {'W', "0 6 1.3 0 2.7 4.8 4.1 0 5.4 6"},
    {'X', "0 6 4 0; 0 0 4 6"},
    {'Y', "0 6 2 3 4 6; 2 3 2 0"},
    {'Z', "0 6 4 6 0 0 4 0"},
    {'0', "@ 1.7 3 1.7 3 90 450"},
    {'1', "0.1 4.6 1.7 6 1.7 0; 0.2 0 3.2 0"},
    {'2', "@ 1.85 4.2 1.75 1.8 165 -35 0 0 3.8 0"},
    {'3', "@ 1.75 4.6 1.65 1.4 150 -90 1.2 3.2; 1.75 3.2 @ 1.85 1.6 1.85 1.6 90 -150"},
    {'4', "2.9 0 2.9 6 0 1.8 4 1.8"},
    {'5', "3.5 6 0.6 6 0.3 3.1 @ 1.75 1.95 1.95 1.95 130 -150"},
    {'6', "@ 2.1 3 2.1 3 50 180 @ 1.9 1.9 1.9 1.9 180 540"},
    {'7', "0 6 3.8 6 1.4 0"},
    {'8', "@ 1.9 4.6 1.6 1.4 -90 270 @ 1.9 1.6 1.9 1.6 90 450"},
    {'9', "@ 1.7 3 2.1 3 230 360 @ 1.9 4.1 1.9 1.9 0 360"},
    {'-', "0 2.8 2.2 2.8"},
}};

double read_number(const char*& at) {
  char* end = nullptr;
  const double value = std::strtod(at, &end);
  at = end;
  return value;
}

void run_along_ellipse(const char*& at, std::vector<GlyphPoint>& stroke) {
  std::array<double, 6> v{};
  for (double& number : v) number = read_number(at);
  const auto [cx, cy, rx, ry, from, to] = v;
  const int steps = static_cast<int>(std::ceil(std::abs(to - from) / 15));
  for (int i = 0; i <= steps; ++i) {
    const double angle = degrees(from + (to - from) * i / steps).count();
    const GlyphPoint p{cx + rx * std::cos(angle), cy + ry * std::sin(angle)};
    const bool repeated = !stroke.empty() && std::hypot(stroke.back().x - p.x, stroke.back().y - p.y) < 1e-6;
    if (!repeated) stroke.push_back(p);
  }
}

Glyph draw(const char* at) {
  Glyph glyph;
  glyph.strokes.emplace_back();
  while (*at != '\0') {
    if (*at == ' ') {
      ++at;
    } else if (*at == ';') {
      glyph.strokes.emplace_back();
      ++at;
    } else if (*at == '@') {
      run_along_ellipse(++at, glyph.strokes.back());
    } else {
      const double x = read_number(at), y = read_number(at);
      glyph.strokes.back().push_back({x, y});
    }
  }
  for (const auto& stroke : glyph.strokes)
    for (const GlyphPoint& p : stroke) glyph.width = std::max(glyph.width, p.x);
  return glyph;
}

std::map<char, Glyph> draw_all() {
  std::map<char, Glyph> glyphs;
  for (const GlyphDrawing& drawing : kDrawings) glyphs.emplace(drawing.character, draw(drawing.strokes));
  return glyphs;
}

}  // namespace

const Glyph* find_glyph(char c) {
  static const std::map<char, Glyph> kGlyphs = draw_all();
  const auto found = kGlyphs.find(c);
  return found == kGlyphs.end() ? nullptr : &found->second;
}

}  // namespace veneer::planner
