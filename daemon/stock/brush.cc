#include "daemon/stock/brush.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

namespace veneer::daemon {
namespace {

// How far a polygon's sides may lie from the round, and a simplified stroke from the one that was drawn.
constexpr double kRoundness = 0.04, kStraightness = 0.05;  // mm
// Corners are whole micrometres, and each union rounds where borders meet: no more than this in all.
constexpr double kUnionRounding = 0.01;  // mm

double distance_to_segment(const Point<PanelFrame>& p, const Point<PanelFrame>& a, const Point<PanelFrame>& b) {
  const double x = (b.x - a.x).count(), y = (b.y - a.y).count();
  const double px = (p.x - a.x).count(), py = (p.y - a.y).count();
  const double length2 = x * x + y * y;
  const double along = length2 > 0 ? std::clamp((px * x + py * y) / length2, 0.0, 1.0) : 0;
  return std::hypot(px - along * x, py - along * y);
}

// Douglas and Peucker's: every point of either lies within `tolerance` of the other.
BrushStroke simplified(const BrushStroke& stroke, double tolerance) {
  if (stroke.size() < 3) return stroke;
  std::vector<bool> stays(stroke.size(), false);
  stays.front() = stays.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, stroke.size() - 1}};
  while (!open.empty()) {
    const auto [from, to] = open.back();
    open.pop_back();
    double most = tolerance;
    std::size_t farthest = 0;
    for (std::size_t i = from + 1; i < to; ++i)
      if (const double d = distance_to_segment(stroke[i], stroke[from], stroke[to]); d > most) most = d, farthest = i;
    if (farthest == 0) continue;
    stays[farthest] = true;
    open.push_back({from, farthest});
    open.push_back({farthest, to});
  }
  BrushStroke out;
  for (std::size_t i = 0; i < stroke.size(); ++i)
    if (stays[i]) out.push_back(stroke[i]);
  return out;
}

struct Brush {
  double radius = 0;
  int sides = 8;  // of half a round
  bool outwards = false;
};

Brush brush_of(Millimetres width, BrushEdge edge, double slack) {
  Brush out;
  out.outwards = edge == BrushEdge::kOutwards;
  out.radius = width.count() / 2 + (out.outwards ? slack : -slack);
  // radius (1 - cos(pi / 2n)) <= kRoundness, nearly.
  out.sides = std::clamp(static_cast<int>(std::ceil(std::numbers::pi / std::sqrt(8 * kRoundness / out.radius))), 6, 32);
  return out;
}

// The brush from `a` to `b`: two half rounds, a whole one where both are the same. Sides that touch the round from
// outside have their corners halfway between the places where they touch.
Region<PanelFrame> swept(const Point<PanelFrame>& a, const Point<PanelFrame>& b, const Brush& brush) {
  const double along = std::atan2((b.y - a.y).count(), (b.x - a.x).count());
  const double step = std::numbers::pi / brush.sides;
  const double reach = brush.outwards ? brush.radius / std::cos(step / 2) : brush.radius;
  Ring<PanelFrame> out;
  for (const auto& [end, begin] :
       {std::pair(b, along - std::numbers::pi / 2), std::pair(a, along + std::numbers::pi / 2)})
    for (int i = 0; i < brush.sides + (brush.outwards ? 0 : 1); ++i) {
      const double angle = begin + step * (i + (brush.outwards ? 0.5 : 0));
      out.push_back(
          point<PanelFrame>(end.x.count() + reach * std::cos(angle), end.y.count() + reach * std::sin(angle)));
    }
  return Region<PanelFrame>(out);
}

std::size_t corner_count(const Region<PanelFrame>& area) {
  std::size_t out = 0;
  for (const auto& ring : area.micro_area().rings) out += ring.size();
  return out;
}

Error too_intricate() {
  return {
      ErrorCode::kInvalidArgument,
      fmt::format("these strokes are more than one saving takes ({} points, or {} corners of what they cover): save "
                  "fewer of them at once, or take a wider brush",
                  kMostBrushPoints, kMostBrushedCorners)};
}

// Halves first: what lies side by side in a stroke overlaps most, and is simple once it is one.
Result<Region<PanelFrame>> united(std::span<const Region<PanelFrame>> parts) {
  if (parts.empty()) return Region<PanelFrame>();
  if (parts.size() == 1) return parts.front();
  auto first = united(parts.first(parts.size() / 2));
  if (!first) return first;
  auto second = united(parts.subspan(parts.size() / 2));
  if (!second) return second;
  Region<PanelFrame> out = unite(*first, *second);
  if (corner_count(out) > kMostBrushedCorners) return too_intricate();
  return out;
}

}  // namespace

Result<Region<PanelFrame>> brushed(const std::vector<BrushStroke>& strokes, Millimetres width, BrushEdge edge) {
  if (!(width >= kNarrowestBrush && width <= kWidestBrush))
    return Error{ErrorCode::kInvalidArgument,
                 fmt::format("a brush is {} to {} mm wide, not {:.3g}", kNarrowestBrush.count(), kWidestBrush.count(),
                             width.count())};
  std::size_t points = 0;
  for (const BrushStroke& stroke : strokes) points += stroke.size();
  if (points > kMostBrushPoints) return too_intricate();
  const Brush brush = brush_of(width, edge, kUnionRounding + kStraightness);
  std::vector<Region<PanelFrame>> parts;
  for (const BrushStroke& drawn : strokes) {
    const BrushStroke stroke = simplified(drawn, kStraightness);
    for (std::size_t i = 0; i < stroke.size(); ++i)
      if (i > 0 || stroke.size() == 1) parts.push_back(swept(stroke[i > 0 ? i - 1 : 0], stroke[i], brush));
  }
  return united(parts);
}

}  // namespace veneer::daemon
