// Exact matching, by proof: the answers are what an exhaustive search over all candidates would give.
//
// A place is discarded only when a lower bound of its cost exceeds the cost of a place already found. Bounds from
// coarse to fine: block features over cells of places (cell_index.h), sums of rows and whole windows in 16 bits,
// stopped early (rotated_panel.h), then the exact cost (patch_pixels.h). Equal costs are decided by panel, rotation,
// row, column, so the answer does not depend on the order of the search.
//
// Patches that do not fill their windows: blocks that are filled in part give no bound, so the search takes longer.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "planner/matching/certified_search.h"

namespace veneer::planner {

class CertifiedMatcher final : public Matcher {
 public:
  // `entries_per_unit` scales responses to 16-bit entries; kernels.h says what fits. `turns` are the rotations.
  CertifiedMatcher(std::vector<MatchPanel> panels, std::vector<Radians> turns, std::vector<WindowClass> classes,
                   double entries_per_unit);

  Status build_index(int threads, const std::stop_token& stop, const IndexProgress& progress = {}) override;
  std::size_t index_bytes() const override;

  Result<std::optional<LatticeCandidate>> best(const MatchPatch& patch, const std::stop_token& stop) const override {
    return best(patch, stop, {}, nullptr);
  }
  // Among the places that are not alike() one of `found`.
  Result<std::optional<LatticeCandidate>> best(const MatchPatch& patch, const std::stop_token& stop,
                                               std::span<const LatticeCandidate> found, MatchCounts* counts) const;
  Result<std::vector<LatticeCandidate>> candidates(const MatchPatch& patch, std::size_t count,
                                                   const std::stop_token& stop) const override;

 private:
  Status index_lattice(std::size_t at, const std::stop_token& stop);
  void remove(int panel, const std::vector<Ring<PanelFrame>>& taken) override;
  Status find_places(int threads, const std::stop_token& stop) override;

  std::vector<WindowClass> classes_;
  std::vector<std::vector<BlockedPixels>> blocked_;  // per panel, per window class
  double entries_per_unit_;
  std::vector<IndexedLattice> indexed_;  // panel by panel, rotation by rotation
};

}  // namespace veneer::planner
