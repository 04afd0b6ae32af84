// Borders that are lines across their artwork (cut_lines.h), and how to move them.
#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "planner/boundaries/borders.h"

namespace veneer::planner {

class BoundaryCuts : public Borders {
 public:
  // The borders of the queue's patches as their layouts have them: rectangles or a morphed grid's cells, which cover
  // their artworks.
  BoundaryCuts(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options);

  Status cut(const PatchPlacements& placements, const std::stop_token& stop) override;

 private:
  State drawn(std::vector<CutLines> lines) const;
  struct Proposal {
    std::vector<CutLines> by_pixels, smooth;
  };
  Proposal proposal(const std::vector<FaceCost>& costs);
  RefineReport::PixelCut beside(const std::vector<CutLines>& lines, const std::vector<CutLines>& by_pixels) const;
  CutOptions cut_options() const;
  Millimetres width_of(std::size_t artwork) const;

  std::optional<std::size_t> bend_;  // of kBends: what was smooth enough at the last cut
};

}  // namespace veneer::planner
