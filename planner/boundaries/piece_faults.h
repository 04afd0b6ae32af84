// What keeps pieces from being made where they lie: shapes that cannot be cut and handled, wood that is not theirs.
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "base/polygon_ops.h"
#include "planner/layout/fabrication.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct PieceLimits {
  FabricationLimits limits;
  Millimetres size{0};  // a piece holds a disc of this diameter; 0: that is not asked
};

// What rounding to whole micrometres may take of FreeWood::kSlack.
inline constexpr Millimetres kBorderRounding{0.001};

// Pieces at one set of placements, looked at again and again while some of their outlines change: what did not is not
// looked at anew. Not thread-safe; panels and placements outlive this.
class PieceFaults {
 public:
  struct Fault {
    bool found = false, everywhere = false;
    std::vector<Point<ArtworkFrame>> places;  // points of the artwork near where it is
  };

  PieceFaults(const std::vector<MatchPanel>& panels, const PatchPlacements& placements, const PieceLimits& limits,
              int threads)
      : panels_(panels), placements_(placements), limits_(limits), threads_(threads) {}

  // One a piece.
  std::vector<Fault> of(const std::vector<Ring<ArtworkFrame>>& outlines);

 private:
  Fault of_shape(const Ring<ArtworkFrame>& outline) const;
  // And what its place does to it; notes what wood it takes.
  Fault of_piece(std::size_t i, const Ring<ArtworkFrame>& outline);

  const std::vector<MatchPanel>& panels_;
  const PatchPlacements& placements_;
  PieceLimits limits_;
  int threads_;
  std::vector<Ring<ArtworkFrame>> outlines_;  // as they were looked at
  std::vector<Fault> own_;                    // what is wrong with a piece by itself
  std::vector<Region<PanelFrame>> grown_;     // by the kerf, where it lies
  std::vector<Box<PanelFrame>> boxes_;
  std::map<std::pair<std::size_t, std::size_t>, Region<PanelFrame>> shared_;  // by two pieces that lie near each other
};

}  // namespace veneer::planner
