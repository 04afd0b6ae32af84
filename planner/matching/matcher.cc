#include "planner/matching/matcher.h"

#include <algorithm>
#include <cmath>

#include "planner/parallel.h"

namespace veneer::planner {

Matcher::Matcher(std::vector<MatchPanel> panels, std::vector<Radians> turns)
    : panels_(std::move(panels)), turns_(std::move(turns)) {
  for (const MatchPanel& panel : panels_)
    for (const Radians turn : turns_)
      lattices_.emplace_back(panel.features.pixels.cols, panel.features.pixels.rows, turn);
}

Isometry2<PanelFrame, ArtworkFrame> Matcher::panel_from_artwork(const MatchPatch& patch,
                                                                const LatticeCandidate& candidate) const {
  return planner::panel_from_artwork(lattice(candidate.panel, candidate.rotation),
                                     panels_[static_cast<std::size_t>(candidate.panel)].features, patch.grid,
                                     patch.pixels.left, patch.pixels.top, candidate.x, candidate.y);
}

double Matcher::exact_cost(const MatchPatch& patch, const LatticeCandidate& candidate, double limit) const {
  return placement_cost(*patch.features, patch.grid, patch.pixels,
                        panels_[static_cast<std::size_t>(candidate.panel)].features,
                        panel_from_artwork(patch, candidate), limit);
}

bool Matcher::admits(const MatchPatch& patch, const LatticeCandidate& candidate) const {
  return panels_[static_cast<std::size_t>(candidate.panel)].wood.admits(panel_from_artwork(patch, candidate) *
                                                                        patch.outline);
}

void Matcher::take(const MatchPatch& patch, const LatticeCandidate& candidate) {
  take(candidate.panel, panel_from_artwork(patch, candidate) * patch.outline);
}

void Matcher::take(int panel, const Ring<PanelFrame>& outline) {
  FreeWood& wood = panels_[static_cast<std::size_t>(panel)].wood;
  wood.allocate(outline);
  const std::vector<Ring<PanelFrame>> taken = grown_rings(outline, wood.kerf());
  if (!clearances_.empty()) clearances_[static_cast<std::size_t>(panel)].take(taken);
  remove(panel, taken);
}

Status Matcher::measure_clearance(const std::vector<WindowClass>& classes, int threads, const std::stop_token& stop) {
  widest_disc_ = 0;  // no disc in a window is wider than its shorter side
  for (const WindowClass& windows : classes)
    if (!windows.filled) widest_disc_ = std::max(widest_disc_, std::min(windows.widest, windows.tallest) + 2);
  return measure_clearance(threads, stop);
}

Status Matcher::measure_clearance(int threads, const std::stop_token& stop) {
  if (widest_disc_ == 0) return Ok();
  std::vector<std::optional<Clearance>> measured(panels_.size());
  Status done = run_parallel(panels_.size(), threads, stop, [&](std::size_t p) -> Status {
    const MatchPanel& panel = panels_[p];
    Result<Clearance> it = Clearance::measure(
        panel.wood, panel.features.resolution.to_mm(Pixels(widest_disc_ / 2.0)) + panel.wood.kerf(), stop);
    if (!it.ok()) return it.error();
    measured[p] = std::move(*it);
    return Ok();
  });
  if (!done.ok()) return done;
  clearances_.clear();
  for (auto& it : measured) clearances_.push_back(std::move(*it));
  return Ok();
}

std::size_t Matcher::clearance_bytes() const {
  std::size_t sum = 0;
  for (const Clearance& it : clearances_) sum += it.bytes();
  return sum;
}

std::vector<Cover> Matcher::cover(const MatchPatch& patch) const {
  std::vector<Cover> out;
  if (clearances_.empty()) return out;
  const std::vector<CoverDisc> discs = cover_of(patch.outline, patch.grid, patch.pixels.left, patch.pixels.top);
  for (std::size_t i = 0; i < lattices_.size(); ++i) {
    const std::size_t panel = i / turns_.size();
    out.emplace_back(discs, lattices_[i], panels_[panel].features, clearances_[panel]);
  }
  return out;
}

Status Matcher::give_back(int threads, const std::stop_token& stop) {
  for (MatchPanel& panel : panels_) panel.wood = panel.wood.untouched();
  if (Status measured = measure_clearance(threads, stop); !measured.ok()) return measured;
  return find_places(threads, stop);
}

bool Matcher::alike(const MatchPatch& patch, const LatticeCandidate& a, const LatticeCandidate& b) const {
  if (a.panel != b.panel) return false;
  const double half_width = patch.pixels.width / 2.0, half_height = patch.pixels.height / 2.0;
  double ax = 0, ay = 0, bx = 0, by = 0;
  lattice(a.panel, a.rotation).to_panel(a.x + half_width, a.y + half_height, ax, ay);
  lattice(b.panel, b.rotation).to_panel(b.x + half_width, b.y + half_height, bx, by);
  return std::hypot(ax - bx, ay - by) < std::min(half_width, half_height);
}

}  // namespace veneer::planner
