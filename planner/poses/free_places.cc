#include "planner/poses/free_places.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "planner/matching/banded_polygon.h"

namespace veneer::planner {
namespace {

// By how much less and more an outline (counter-clockwise) grows for certain, wherever it lies: offset() rounds corners
// to whole micrometres, which turns short sides most. None: rounding decides more than that. At a corner of 60 degrees
// growth turns from pointed to blunt (offset() has the mitre limit 2), and a very short side may vanish.
std::optional<Millimetres> growing_doubt(const Ring<PanelFrame>& outline, Millimetres border) {
  constexpr double kRounding = 0.0015, kShortest = 0.01;  // mm; what moves one end of a side past the other
  constexpr double kBlunt = 2 * std::numbers::pi / 3;     // from this turn on
  double doubt = 0.02;                                    // mm, some times what rounding moves corners by
  std::vector<double> lengths, directions;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point<PanelFrame>&from = outline[i], &to = outline[(i + 1) % outline.size()];
    const double x = (to.x - from.x).count(), y = (to.y - from.y).count();
    lengths.push_back(std::hypot(x, y)), directions.push_back(std::atan2(y, x));
    if (lengths.back() < kShortest) return std::nullopt;
  }
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const std::size_t next = (i + 1) % outline.size();
    const double turn = std::remainder(directions[next] - directions[i], 2 * std::numbers::pi);
    const double turned = kRounding / lengths[i] + kRounding / lengths[next];
    if (std::abs(turn - kBlunt) < turned || std::numbers::pi - std::abs(turn) < turned) return std::nullopt;
    // A moved side turns about where it begins; its tip lies this far from there. Once here, once where it is laid.
    const double tip = border.count() * std::tan(std::clamp(turn, 0.0, kBlunt) / 2);
    doubt = std::max(doubt, 0.005 + 2 * turned * tip);
  }
  return Millimetres(doubt);
}

std::vector<Ring<PanelFrame>> laid_at(const std::vector<Ring<PanelFrame>>& rings, const Pose& at) {
  std::vector<Ring<PanelFrame>> out = rings;
  for (Ring<PanelFrame>& ring : out)
    for (Point<PanelFrame>& p : ring) {
      const double x = p.x.count(), y = p.y.count();
      p = point<PanelFrame>(at.x + at.cos * x - at.sin * y, at.y + at.sin * x + at.cos * y);
    }
  return out;
}

}  // namespace

FreePlaces::FreePlaces(const Ring<ArtworkFrame>& outline, const Footprint& footprint,
                       const std::vector<MatchPanel>& panels)
    : outline_(&outline), footprint_(&footprint), panels_(&panels) {
  if (panels.empty() || is_convex(outline)) return;
  const Millimetres border = panels.front().wood.border();
  const Ring<PanelFrame> centred = footprint.panel_from_artwork(pose_at(0, 0, 0, 0)) * outline;
  const std::optional<Millimetres> doubt = growing_doubt(centred, border);
  if (!doubt) return;
  narrow_ = grown_rings(centred, border - *doubt), wide_ = grown_rings(centred, border + *doubt);
}

bool FreePlaces::clear_of_settled(const Pose& at) const {
  return !wood(at).has_settled() || !wood(at).collides_with_settled(laid(at));
}

bool FreePlaces::on_free_wood(const Pose& at) const {
  const FreeWood& wood = this->wood(at);
  if (narrow_.empty() || wide_.empty()) return wood.on_free_wood(laid(at));
  if (!wood.touches_only_free(laid_at(narrow_, at))) return false;
  if (!wood.touches_only_free(laid_at(wide_, at))) return wood.on_free_wood(laid(at));
  return clear_of_settled(at);
}

}  // namespace veneer::planner
