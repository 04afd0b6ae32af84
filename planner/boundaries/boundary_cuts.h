// All borders of a plan where they are now: lines, curves and outlines, and how to move them.
#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "planner/boundaries/curved_layout.h"
#include "planner/boundaries/wood_claims.h"
#include "planner/layout/fabrication.h"
#include "planner/layout/partition.h"
#include "planner/matching/matcher.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct BoundaryOptions {
  Millimetres overlap{0};  // how far a piece may grow over its border; 0: three eighths of the smallest patch
  Smoothness smoothness = Smoothness::kG0;
  FabricationLimits limits;
  int threads = 1;
};

// Not thread-safe. The problem and the panels outlive this.
class BoundaryCuts {
 public:
  // The borders of the queue's patches as their layouts have them: rectangles or a morphed grid's cells, which cover
  // their artworks.
  BoundaryCuts(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options);

  // Moves the borders to where the pieces show the picture best, given the wood around each. What results is
  // fabricable and keeps to the wood as it was before, where that was so. kCancelled: a stop was requested, and nothing
  // has changed.
  Status cut(const PatchPlacements& placements, const std::stop_token& stop);

  // The wished placements, but for pieces that would not have free wood of their own there, kerf included: these stay
  // where they were, `before`, and so does who wished for that place. What is wrong with a shape is so wherever it
  // lies, and no reason against a place. kCancelled: a stop was requested.
  Result<PatchPlacements> settled(const PatchPlacements& wished, const PatchPlacements& before,
                                  const std::stop_token& stop) const;

  // Goes back to borders of the same problem as they were.
  void become(const BoundaryCuts& before) { now_ = before.now_; }

  // One a task of the queue.
  const std::vector<Ring<ArtworkFrame>>& outlines() const { return now_.outlines; }
  // One an artwork; faces in the order of faces().
  const std::vector<Partition>& layouts() const { return now_.layouts; }
  // The tasks of an artwork's faces.
  const std::vector<std::size_t>& faces(std::size_t artwork) const { return members_[artwork]; }
  const CurveLength& curves() const { return now_.curves; }

 private:
  struct State {
    std::vector<CutLines> lines;  // one an artwork
    std::vector<Partition> layouts;
    std::vector<Ring<ArtworkFrame>> outlines;
    CurveLength curves;
  };
  State drawn(std::vector<CutLines> lines) const;
  std::vector<CutLines> proposal(const std::vector<FaceCost>& costs) const;
  // What keeps a piece from being made: points of the artwork near where it is.
  struct Fault {
    bool found = false, everywhere = false;
    std::vector<Point<ArtworkFrame>> places;
  };
  struct Looked;
  std::vector<Fault> faults(const State& state, const PatchPlacements& placements, Looked& looked) const;
  CutOptions cut_options() const;
  PlanePoint px_of(std::size_t artwork, const Point<ArtworkFrame>& p) const;
  Millimetres width_of(std::size_t artwork) const;
  cv::Rect window_of(std::size_t task) const;

  const Problem& problem_;
  std::vector<MatchPanel> panels_;
  BoundaryOptions options_;
  double reach_ = 0;                               // pixels
  std::vector<std::vector<std::size_t>> members_;  // of each artwork
  std::vector<Box<ArtworkFrame>> cells_;           // of each task, as the layout has it
  State now_;
};

}  // namespace veneer::planner
