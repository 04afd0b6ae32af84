// What a brush covers: the wood under strokes that somebody drew over a panel's map with a finger. Pure.
#pragma once

#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"

namespace veneer::daemon {

// Corners of one stroke; a single one is a dab.
using BrushStroke = std::vector<Point<PanelFrame>>;

// A round brush of this width drawn along each. Its round is a polygon within the circle, 2 % of the radius at most
// short of it: what is given is never more than was drawn over.
Region<PanelFrame> brushed(const std::vector<BrushStroke>& strokes, Millimetres width);

}  // namespace veneer::daemon
