// Pieces of an artwork as the matcher places them: turned by any of 15 angles, wherever their wood was found.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "planner/cutting/toolpath.h"

namespace veneer::planner::test {

// In reading order of the artwork (26 columns), on a panel of 480 x 340 mm; kerfs do not overlap. Deterministic.
inline std::vector<ToolpathPiece> scattered_pieces(int count, double side, bool marks) {
  std::mt19937 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  std::vector<ToolpathPiece> pieces;
  std::vector<Region<BedFrame>> taken;
  for (int tries = 0; static_cast<int>(pieces.size()) < count && tries < 400000; ++tries) {
    const double x = uniform(20, 460), y = uniform(20, 320);
    const double turn = 2 * kPi * static_cast<double>(random() % 15) / 15;
    const double c = std::cos(turn) * side / 2, s = std::sin(turn) * side / 2;
    const Ring<BedFrame> outline = {point<BedFrame>(x - c + s, y - s - c), point<BedFrame>(x + c + s, y + s - c),
                                    point<BedFrame>(x + c - s, y + s + c), point<BedFrame>(x - c - s, y - s + c)};
    const auto clear = [&](std::size_t k) {
      const auto& other = pieces[k].outline;
      const double ox = (other[0].x + other[2].x).count() / 2, oy = (other[0].y + other[2].y).count() / 2;
      if (std::hypot(x - ox, y - oy) > 1.45 * side + 1) return true;
      return !overlaps(taken[k], offset(Region<BedFrame>(outline), Millimetres(0.27)));
    };
    bool free = true;
    for (std::size_t k = 0; free && k < pieces.size(); ++k) free = clear(k);
    if (!free) continue;
    taken.push_back(offset(Region<BedFrame>(outline), Millimetres(0.27)));
    const int number = static_cast<int>(pieces.size());
    ToolpathPiece& piece = pieces.emplace_back();
    piece.piece = PieceId{number + 1};
    piece.outline = outline;
    if (marks) piece.mark = "A" + std::to_string(number / 26 + 1) + "-" + std::to_string(number % 26 + 1);
    piece.artwork_up = Radians(turn + kPi / 2);
  }
  return pieces;
}

// Row by row over the panel, each as high as a piece, left to right.
inline std::vector<ToolpathPiece> sorted_by_panel_rows(std::vector<ToolpathPiece> pieces) {
  const auto key = [](const ToolpathPiece& p) {
    const auto box = bounds(p.outline);
    return std::pair{std::floor((box.min.y + box.max.y).count() / 2 / 18), (box.min.x + box.max.x).count()};
  };
  std::stable_sort(pieces.begin(), pieces.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  return pieces;
}

}  // namespace veneer::planner::test
