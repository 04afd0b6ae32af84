#include "daemon/services/brush.h"

#include <cmath>
#include <numbers>

namespace veneer::daemon {
namespace {

constexpr int kSidesOfHalf = 8;

// The brush from `a` to `b`: two half rounds, a whole one where both are the same.
Ring<PanelFrame> swept(const Point<PanelFrame>& a, const Point<PanelFrame>& b, double radius) {
  const double along = std::atan2((b.y - a.y).count(), (b.x - a.x).count());
  Ring<PanelFrame> out;
  for (const auto& [end, begin] :
       {std::pair(b, along - std::numbers::pi / 2), std::pair(a, along + std::numbers::pi / 2)})
    for (int i = 0; i <= kSidesOfHalf; ++i) {
      const double angle = begin + std::numbers::pi * i / kSidesOfHalf;
      out.push_back(
          point<PanelFrame>(end.x.count() + radius * std::cos(angle), end.y.count() + radius * std::sin(angle)));
    }
  return out;
}

}  // namespace

Region<PanelFrame> brushed(const std::vector<BrushStroke>& strokes, Millimetres width) {
  std::vector<Region<PanelFrame>> parts;
  for (const BrushStroke& stroke : strokes)
    for (std::size_t i = 0; i < stroke.size(); ++i)
      if (i > 0 || stroke.size() == 1)
        parts.emplace_back(swept(stroke[i > 0 ? i - 1 : 0], stroke[i], width.count() / 2));
  return unite(parts);
}

}  // namespace veneer::daemon
