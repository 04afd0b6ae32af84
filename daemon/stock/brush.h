// What a brush covers: the wood under strokes that somebody drew over a panel's map with a finger. Pure.
#pragma once

#include <cstddef>
#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "base/result.h"

namespace veneer::daemon {

// Corners of one stroke; a single one is a dab.
using BrushStroke = std::vector<Point<PanelFrame>>;

// Of all strokes together, and corners of what they cover: strokes that cross each other leave gaps between them by the
// square of their number, and every later scan of the panel draws them again.
inline constexpr std::size_t kMostBrushPoints = 500;
inline constexpr std::size_t kMostBrushedCorners = 16'000;
inline constexpr Millimetres kNarrowestBrush{0.5}, kWidestBrush{60};

// A brush is round, its outline a polygon, and a stroke is simplified before it is drawn. What is withheld is never
// less than was painted: kOutwards holds all of it, and 0.15 mm more at most. What is given is never more: kInwards
// lies in it, 0.15 mm within at most.
enum class BrushEdge { kOutwards, kInwards };

// A round brush of this width drawn along each. kInvalidArgument: more points or corners than may be, or a width that
// no brush has.
Result<Region<PanelFrame>> brushed(const std::vector<BrushStroke>& strokes, Millimetres width, BrushEdge edge);

}  // namespace veneer::daemon
