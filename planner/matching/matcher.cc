#include "planner/matching/matcher.h"

#include <algorithm>
#include <cmath>

namespace veneer::planner {

Matcher::Matcher(std::vector<MatchPanel> panels, std::vector<Radians> turns)
    : panels_(std::move(panels)), turns_(std::move(turns)) {
  for (const MatchPanel& panel : panels_)
    for (const Radians turn : turns_)
      lattices_.emplace_back(panel.features.pixels.cols, panel.features.pixels.rows, turn);
}

Isometry2<PanelFrame, ArtworkFrame> Matcher::panel_from_artwork(const MatchPatch& patch,
                                                                const Candidate& candidate) const {
  return planner::panel_from_artwork(lattice(candidate.panel, candidate.rotation),
                                     panels_[static_cast<std::size_t>(candidate.panel)].features, patch.grid,
                                     patch.pixels.left, patch.pixels.top, candidate.x, candidate.y);
}

double Matcher::exact_cost(const MatchPatch& patch, const Candidate& candidate, double limit) const {
  return placement_cost(*patch.features, patch.grid, patch.pixels,
                        panels_[static_cast<std::size_t>(candidate.panel)].features,
                        panel_from_artwork(patch, candidate), limit);
}

bool Matcher::admits(const MatchPatch& patch, const Candidate& candidate) const {
  return panels_[static_cast<std::size_t>(candidate.panel)].wood.admits(panel_from_artwork(patch, candidate) *
                                                                        patch.outline);
}

void Matcher::take(const MatchPatch& patch, const Candidate& candidate) {
  take(candidate.panel, panel_from_artwork(patch, candidate) * patch.outline);
}

void Matcher::take(int panel, const Ring<PanelFrame>& outline) {
  FreeWood& wood = panels_[static_cast<std::size_t>(panel)].wood;
  wood.allocate(outline);
  remove(panel, grown(outline, wood.kerf()));
}

bool Matcher::alike(const MatchPatch& patch, const Candidate& a, const Candidate& b) const {
  if (a.panel != b.panel) return false;
  const double half_width = patch.pixels.width / 2.0, half_height = patch.pixels.height / 2.0;
  double ax = 0, ay = 0, bx = 0, by = 0;
  lattice(a.panel, a.rotation).to_panel(a.x + half_width, a.y + half_height, ax, ay);
  lattice(b.panel, b.rotation).to_panel(b.x + half_width, b.y + half_height, bx, by);
  return std::hypot(ax - bx, ay - by) < std::min(half_width, half_height);
}

}  // namespace veneer::planner
