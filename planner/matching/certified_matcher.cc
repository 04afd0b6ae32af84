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

Status CertifiedMatcher::build_index(int threads, const std::stop_token& stop, const IndexProgress& progress) {
  if (Status done = measure_clearance(classes_, threads, stop); !done.ok()) return done;
  for (const MatchPanel& panel : panels()) {
    auto& blocked = blocked_.emplace_back();
    for (const WindowClass& windows : classes_) {
      BlockedPixels& of_class = blocked.emplace_back();
      if (!windows.filled) continue;
      const double side = std::min(windows.right - windows.left, windows.bottom - windows.top);
      Result<BlockedPixels> found =
          blocked_pixels(panel.wood.raster(), panel.features.resolution.to_mm(Pixels(std::max(side, 1.0))), stop);
      if (!found.ok()) return found.error();
      of_class = std::move(*found);
    }
  }
  return run_parallel(
      indexed_.size(), threads, stop, [&](std::size_t at) { return index_lattice(at, stop); },
      [&](std::size_t begun) {
        if (progress) progress(static_cast<double>(begun) / static_cast<double>(indexed_.size()));
      });
}

Status CertifiedMatcher::index_lattice(std::size_t at, const std::stop_token& stop) {
  IndexedLattice& it = indexed_[at];
  const MatchPanel& panel = panels()[static_cast<std::size_t>(it.panel)];
  Result<RotatedPanel> pixels =
      RotatedPanel::make(panel.features.pixels, lattice(it.panel, it.rotation), entries_per_unit_, stop);
  if (!pixels.ok()) return pixels.error();
  it.pixels = std::make_unique<RotatedPanel>(std::move(*pixels));
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    Result<CellIndex> cells =
        CellIndex::make(*it.pixels, classes_[k], panel.features, blocked_[static_cast<std::size_t>(it.panel)][k],
                        panel.wood.border(), stop);
    if (!cells.ok()) return cells.error();
    it.cells.push_back(std::move(*cells));
  }
  return Ok();
}

void CertifiedMatcher::remove(int panel, const std::vector<Ring<PanelFrame>>& taken) {
  const MatchPanel& it = panels()[static_cast<std::size_t>(panel)];
  for (IndexedLattice& indexed : indexed_) {
    if (indexed.panel != panel) continue;
    for (CellIndex& cells : indexed.cells) cells.remove(taken, it.features, it.wood.kerf());
  }
}

Status CertifiedMatcher::find_places(int threads, const std::stop_token& stop) {
  return run_parallel(indexed_.size(), threads, stop, [&](std::size_t at) -> Status {
    IndexedLattice& it = indexed_[at];
    const auto p = static_cast<std::size_t>(it.panel);
    const MatchPanel& panel = panels()[p];
    for (std::size_t k = 0; k < it.cells.size(); ++k)
      if (Status done = it.cells[k].find_places(panel.features, blocked_[p][k], panel.wood.border(), stop); !done.ok())
        return done;
    return Ok();
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

Result<std::optional<LatticeCandidate>> CertifiedMatcher::best(const MatchPatch& patch, const std::stop_token& stop,
                                                               std::span<const LatticeCandidate> found,
                                                               MatchCounts* counts) const {
  MatchCounts ignored;
  return CertifiedSearch(*this, indexed_, MatchQuery(patch, classes_[patch.window_class], entries_per_unit_), patch,
                         cover(patch), found, stop, counts != nullptr ? *counts : ignored)
      .run();
}

Result<std::vector<LatticeCandidate>> CertifiedMatcher::candidates(const MatchPatch& patch, std::size_t count,
                                                                   const std::stop_token& stop) const {
  std::vector<LatticeCandidate> found;
  while (found.size() < count) {
    const Result<std::optional<LatticeCandidate>> next = best(patch, stop, found, nullptr);
    if (!next.ok()) return next.error();
    if (!*next) break;
    found.push_back(**next);
  }
  return found;
}

}  // namespace veneer::planner
