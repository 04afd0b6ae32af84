#include "planner/matching/certified_matcher.h"

#include <algorithm>

#include "planner/matching/match_query.h"
#include "planner/parallel.h"

namespace veneer::planner {

CertifiedMatcher::CertifiedMatcher(std::vector<MatchPanel> all_panels, std::vector<Radians> turns,
                                   std::vector<WindowClass> classes, double entries_per_unit)
    : Matcher(std::move(all_panels), std::move(turns)),
      classes_(std::move(classes)),
      entries_per_unit_(entries_per_unit) {
  for (std::size_t p = 0; p < panels().size(); ++p)
    for (int r = 0; r < rotations(); ++r) indexed_.push_back({static_cast<int>(p), r, nullptr, {}});
}

void CertifiedMatcher::build_index(int threads, const std::stop_token& stop, const IndexProgress& progress) {
  measure_clearance(classes_, threads, stop);
  for (const MatchPanel& panel : panels()) {
    auto& blocked = blocked_.emplace_back();
    for (const WindowClass& windows : classes_) {
      if (!windows.filled) {
        blocked.emplace_back();
        continue;
      }
      const double side = std::min(windows.right - windows.left, windows.bottom - windows.top);
      blocked.push_back(
          blocked_pixels(panel.wood.raster(), panel.features.resolution.to_mm(Pixels(std::max(side, 1.0))), stop));
    }
  }
  run_parallel(
      indexed_.size(), threads, stop, [&](std::size_t at) { index_lattice(at, stop); },
      [&](std::size_t done) {
        if (progress) progress(static_cast<double>(done) / static_cast<double>(indexed_.size()));
      });
}

void CertifiedMatcher::index_lattice(std::size_t at, const std::stop_token& stop) {
  IndexedLattice& it = indexed_[at];
  const MatchPanel& panel = panels()[static_cast<std::size_t>(it.panel)];
  it.pixels =
      std::make_unique<RotatedPanel>(panel.features.pixels, lattice(it.panel, it.rotation), entries_per_unit_, stop);
  for (std::size_t k = 0; k < classes_.size(); ++k)
    it.cells.emplace_back(*it.pixels, classes_[k], panel.features, blocked_[static_cast<std::size_t>(it.panel)][k],
                          panel.wood.border(), stop);
}

void CertifiedMatcher::remove(int panel, const std::vector<Ring<PanelFrame>>& taken) {
  const MatchPanel& it = panels()[static_cast<std::size_t>(panel)];
  for (IndexedLattice& indexed : indexed_) {
    if (indexed.panel != panel) continue;
    for (CellIndex& cells : indexed.cells) cells.remove(taken, it.features, it.wood.kerf());
  }
}

void CertifiedMatcher::find_places(int threads, const std::stop_token& stop) {
  run_parallel(indexed_.size(), threads, stop, [&](std::size_t at) {
    IndexedLattice& it = indexed_[at];
    const auto p = static_cast<std::size_t>(it.panel);
    const MatchPanel& panel = panels()[p];
    for (std::size_t k = 0; k < it.cells.size(); ++k)
      it.cells[k].find_places(panel.features, blocked_[p][k], panel.wood.border(), stop);
  });
}

std::size_t CertifiedMatcher::index_bytes() const {
  std::size_t sum = clearance_bytes();
  for (const IndexedLattice& it : indexed_) {
    if (it.pixels) sum += it.pixels->bytes();
    for (const CellIndex& cells : it.cells) sum += cells.bytes();
  }
  return sum;
}

std::optional<Candidate> CertifiedMatcher::best(const MatchPatch& patch, const std::stop_token& stop,
                                                std::span<const Candidate> found, MatchCounts* counts) const {
  MatchCounts ignored;
  return CertifiedSearch(*this, indexed_, MatchQuery(patch, classes_[patch.window_class], entries_per_unit_), patch,
                         cover(patch), found, stop, counts != nullptr ? *counts : ignored)
      .run();
}

std::vector<Candidate> CertifiedMatcher::places(const MatchPatch& patch, std::size_t count,
                                                const std::stop_token& stop) const {
  std::vector<Candidate> found;
  while (found.size() < count && !stop.stop_requested()) {
    const auto next = best(patch, stop, found, nullptr);
    if (!next) break;
    found.push_back(*next);
  }
  return found;
}

}  // namespace veneer::planner
