#include "planner/poses/free_places.h"

#include "planner/matching/banded_polygon.h"

namespace veneer::planner {
namespace {

// By so much less or more: some times what rounding moves corners and the sides between near ones.
constexpr Millimetres kGrowingDoubt{0.02};

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
  border_ = panels.front().wood.border();
  const Ring<PanelFrame> centred = footprint.panel_from_artwork(pose_at(0, 0, 0, 0)) * outline;
  narrow_ = grown_rings(centred, border_ - kGrowingDoubt), wide_ = grown_rings(centred, border_ + kGrowingDoubt);
}

bool FreePlaces::clear_of_settled(const Pose& at) const {
  return !wood(at).has_settled() || !wood(at).collides_with_settled(laid(at));
}

bool FreePlaces::on_free_wood(const Pose& at) const {
  const FreeWood& wood = this->wood(at);
  if (narrow_.empty() || wide_.empty() || wood.border() != border_) return wood.on_free_wood(laid(at));
  if (!wood.touches_only_free(laid_at(narrow_, at))) return false;
  if (!wood.touches_only_free(laid_at(wide_, at))) return wood.on_free_wood(laid(at));
  return clear_of_settled(at);
}

}  // namespace veneer::planner
