// Plain single-line capitals and digits for tests, in the manner of engraving fonts: 6 units high, about 4 wide.
#pragma once

#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/sim/plane.h"

namespace veneer::sim {

using Stroke = std::vector<Vec2>;

inline const std::map<char, std::string>& stroke_glyphs() {
  static const std::map<char, std::string> kGlyphs{
      {'A', "0 0 2 6 4 0;0.7 2 3.3 2"},
      {'B', "0 0 0 6 2.6 6 3.5 5.5 3.7 4.6 3.5 3.7 2.6 3.2 0 3.2;2.6 3.2 3.7 2.7 4 1.6 3.7 .5 2.6 0 0 0"},
      {'C', "4 4.6 3.5 5.5 2.6 6 1.6 6 .8 5.5 .2 4.5 0 3 .2 1.5 .8 .5 1.6 0 2.6 0 3.5 .5 4 1.4"},
      {'D', "0 0 0 6 2 6 3.2 5.4 3.8 4.2 4 3 3.8 1.8 3.2 .6 2 0 0 0"},
      {'E', "3.8 6 0 6 0 0 3.8 0;0 3.1 2.8 3.1"},
      {'F', "3.8 6 0 6 0 0;0 3.1 2.8 3.1"},
      {'G', "4 4.6 3.5 5.5 2.6 6 1.6 6 .8 5.5 .2 4.5 0 3 .2 1.5 .8 .5 1.6 0 2.6 0 3.5 .5 4 1.4 4 2.7 2.5 2.7"},
      {'H', "0 0 0 6;4 0 4 6;0 3.1 4 3.1"},
      {'I', "1 0 1 6;0 6 2 6;0 0 2 0"},
      {'J', "1.2 6 3.2 6 3.2 1.5 2.8 .5 2 0 1.2 0 .4 .5 0 1.5"},
      {'K', "0 0 0 6;4 6 0 2.4;1.4 3.7 4 0"},
      {'L', "0 6 0 0 3.6 0"},
      {'M', "0 0 0 6 2.2 1.2 4.4 6 4.4 0"},
      {'N', "0 0 0 6 4 0 4 6"},
      {'O', "1.8 6 .9 5.5 .2 4.5 0 3 .2 1.5 .9 .5 1.8 0 2.8 0 3.7 .5 4.4 1.5 4.6 3 4.4 4.5 3.7 5.5 2.8 6 1.8 6"},
      {'P', "0 0 0 6 2.6 6 3.6 5.4 3.9 4.4 3.6 3.4 2.6 2.8 0 2.8"},
      {'Q',
       "1.8 6 .9 5.5 .2 4.5 0 3 .2 1.5 .9 .5 1.8 0 2.8 0 3.7 .5 4.4 1.5 4.6 3 4.4 4.5 3.7 5.5 2.8 6 1.8 6;"
       "2.8 1.5 4.6 -.4"},
      {'R', "0 0 0 6 2.6 6 3.6 5.4 3.9 4.5 3.6 3.6 2.6 3 0 3;2 3 4 0"},
      {'S',
       "3.8 4.9 3.4 5.6 2.6 6 1.4 6 .6 5.6 .2 4.8 .4 4 1.2 3.4 2.8 2.7 3.7 2.1 4 1.3 3.6 .5 2.7 0 1.3 0 .4 .4 0 "
       "1.1"},
      {'T', "2 0 2 6;0 6 4 6"},
      {'U', "0 6 0 1.8 .4 .7 1.4 0 2.6 0 3.6 .7 4 1.8 4 6"},
      {'V', "0 6 2 0 4 6"},
      {'W', "0 6 1.2 0 2.6 4.6 4 0 5.2 6"},
      {'X', "0 6 4 0;0 0 4 6"},
      {'Y', "0 6 2 3 4 6;2 3 2 0"},
      {'Z', "0 6 4 6 0 0 4 0"},
      {'0', "1.6 6 .7 5.5 .2 4.5 0 3 .2 1.5 .7 .5 1.6 0 2.2 0 3.1 .5 3.6 1.5 3.8 3 3.6 4.5 3.1 5.5 2.2 6 1.6 6"},
      {'1', "0 4.6 1.6 6 1.6 0;0.2 0 3 0"},
      {'2', "0 4.5 .3 5.4 1.2 6 2.6 6 3.5 5.4 3.7 4.5 3.3 3.4 0 0 3.8 0"},
      {'3',
       ".1 5 .7 5.7 1.5 6 2.4 6 3.3 5.5 3.6 4.6 3.3 3.7 2.3 3.2 1.3 3.2;2.3 3.2 3.4 2.7 3.8 1.7 3.4 .6 2.4 0 1.4 0 "
       ".5 .4 0 1.1"},
      {'4', "2.8 0 2.8 6 0 1.8 4 1.8"},
      {'5', "3.5 6 .5 6 .2 3.3 1 3.7 2.2 3.8 3.2 3.3 3.8 2.2 3.6 1 2.8 .2 1.8 0 .8 .2 0 .9"},
      {'6', "3.2 5.4 2.4 6 1.6 6 .8 5.4 .2 4 0 2.4 .2 1 .9 .2 1.9 0 2.9 .3 3.6 1.2 3.6 2.4 3 3.3 2 3.7 1 3.4 .2 2.4"},
      {'7', "0 6 3.8 6 1.4 0"},
      {'8',
       "1.9 3.2 .8 3.7 .3 4.6 .8 5.6 1.9 6 3 5.6 3.5 4.6 3 3.7 1.9 3.2 .6 2.7 0 1.6 .5 .5 1.9 0 3.3 .5 3.8 1.6 3.2 "
       "2.7 1.9 3.2"},
      {'9',
       "3.6 3.6 2.9 2.6 1.8 2.3 .7 2.7 .1 3.6 .1 4.8 .8 5.7 1.8 6 2.8 5.8 3.5 5 3.7 3.6 3.5 2 2.9 .6 2 0 1.2 0 .4 "
       ".6"},
      {'-', "0 3 2.2 3"},
  };
  return kGlyphs;
}

// The strokes of a text and, last, of its baseline bar, in millimetres: lower left of the text at the origin, +y up.
inline std::vector<Stroke> stroke_text(std::string_view text, double height, double gap) {
  std::vector<Stroke> out;
  const double unit = height / 6;
  double x = 0;
  for (const char c : text) {
    double right = 0;
    Stroke stroke;
    const std::string& glyph = stroke_glyphs().at(c);
    for (const char* at = glyph.c_str(); *at != 0;) {
      char* next = nullptr;
      const double px = std::strtod(at, &next);
      const double py = std::strtod(next, &next);
      stroke.push_back({x + px * unit, py * unit});
      right = std::max(right, px * unit);
      at = next;
      if (*at == ';' || *at == 0) {
        out.push_back(std::move(stroke));
        stroke = {};
        if (*at == ';') ++at;
      }
    }
    x += right + gap;
  }
  out.push_back({{0, -0.35 * height}, {x - gap, -0.35 * height}});
  return out;
}

}  // namespace veneer::sim
