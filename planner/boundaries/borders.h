// All borders of a plan where they are now: curves and outlines, and how to move them.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "planner/boundaries/curved_layout.h"
#include "planner/boundaries/piece_faults.h"
#include "planner/boundaries/wood_claims.h"
#include "planner/layout/partition.h"
#include "planner/matching/matcher.h"
#include "planner/plan.h"
#include "planner/problem/problem.h"

namespace veneer::planner {

struct BoundaryOptions {
  Millimetres overlap{0};  // how far a piece may grow over its border; 0: three eighths of a patch
  Smoothness smoothness = Smoothness::kG0;
  PieceLimits limits;
  int threads = 1;
};

// Not thread-safe. The problem outlives this.
class Borders {
 public:
  struct State {
    std::vector<CutLines> lines;               // of artworks that are cut along lines, one each; else none
    std::vector<Partition> layouts;            // one an artwork; faces in the order of faces()
    std::vector<Ring<ArtworkFrame>> outlines;  // one a task of the queue
    CurveLength curves;
    std::optional<RefineReport::PixelCut> pixel_cut;  // of the last cut, where there are lines
  };

  virtual ~Borders() = default;
  Borders(const Borders&) = delete;
  Borders& operator=(const Borders&) = delete;

  // Moves the borders to where the pieces show the picture best, given the wood around each. What results is
  // fabricable and keeps to the wood as it was before, where that was so. kCancelled: a stop was requested, and nothing
  // has changed.
  virtual Status cut(const PatchPlacements& placements, const std::stop_token& stop) = 0;

  // The wished placements, but for pieces that would not have free wood of their own there, kerf included: these stay
  // where they were, `before`, and so does who wished for that place. What is wrong with a shape is so wherever it
  // lies, and no reason against a place. kCancelled: a stop was requested.
  Result<PatchPlacements> settled(const PatchPlacements& wished, const PatchPlacements& before,
                                  const std::stop_token& stop) const;

  const State& state() const { return now_; }
  // Goes back to how they were.
  void become(State before) { now_ = std::move(before); }
  const std::vector<Ring<ArtworkFrame>>& outlines() const { return now_.outlines; }
  // The tasks of an artwork's faces.
  const std::vector<std::size_t>& faces(std::size_t artwork) const { return members_[artwork]; }

 protected:
  Borders(const Problem& problem, const std::vector<MatchPanel>& panels, const BoundaryOptions& options);

  // Of the working resolution.
  double px(Millimetres length) const;
  PlanePoint px_of(std::size_t artwork, const Point<ArtworkFrame>& p) const;
  // Where moving borders keep from each other.
  double gap() const;
  Result<std::vector<FaceCost>> costs_around(const PatchPlacements& placements, const std::stop_token& stop) const;
  // Layouts, outlines and length of curves of what has its lines.
  void add_outlines(State& state) const;

  const Problem& problem_;
  std::vector<MatchPanel> panels_;
  BoundaryOptions options_;
  double reach_ = 0;                               // pixels; of a deriving class
  std::vector<std::vector<std::size_t>> members_;  // of each artwork
  std::vector<Box<ArtworkFrame>> cells_;           // of each task, as the layout has it
  State now_;

 private:
  cv::Rect window_of(std::size_t task) const;
};

// Of the queue's patches as their layouts have them: rectangles and a morphed grid's cells are cut along lines
// (boundary_cuts.h), whatever else has edges, each by itself (edge_cuts.h).
std::unique_ptr<Borders> make_borders(const Problem& problem, const std::vector<MatchPanel>& panels,
                                      const BoundaryOptions& options);

// How much of the way to where borders are wanted they go, the time that something is wrong with pieces.
inline constexpr double kDrawBack = 0.5;
inline constexpr Millimetres kDrawBackNear{1};  // around points where something is wrong
inline constexpr int kWholeFacesAfter = 4, kStayAfter = 6;
inline constexpr double kReachShare = 0.375;      // of a patch's side
inline constexpr Millimetres kBorderStride{0.5};  // between the controls of smooth borders
// What a turn of a smooth border costs, in mean costs of a stride as wide as the whole overlap, until curves are long
// enough.
inline constexpr std::array kBends = {0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064};
// Over the pixels that the faces may have.
double mean_cost(const std::vector<FaceCost>& costs);
// As little smoothing as gives curves of the wanted length; the smoother, the longer they are. `smoothed(bend)` answers
// what says whether it `is_smooth()`.
template <class Smoothed>
auto smoothed_enough(const Smoothed& smoothed) {
  std::size_t too_little = 0, enough = kBends.size() - 1;
  std::optional<decltype(smoothed(0.0))> out;  // of `enough`, when that was looked at
  while (too_little < enough) {
    const std::size_t middle = (too_little + enough) / 2;
    auto it = smoothed(kBends[middle]);
    if (it.is_smooth())
      enough = middle, out = std::move(it);
    else
      too_little = middle + 1;
  }
  return out ? *std::move(out) : smoothed(kBends[enough]);
}
// The same, where it was known of borders much like these: `bend` is what was enough of kBends then, and becomes what
// is now. What `smoothed` answers says its `bend` too.
template <class Smoothed>
auto smoothed_enough(const Smoothed& smoothed, std::optional<std::size_t>& bend) {
  if (!bend) {
    auto out = smoothed_enough(smoothed);
    bend = static_cast<std::size_t>(std::find(kBends.begin(), kBends.end(), out.bend) - kBends.begin());
    return out;
  }
  auto out = smoothed(kBends[*bend]);
  if (!out.is_smooth()) {
    while (!out.is_smooth() && *bend + 1 < kBends.size()) out = smoothed(kBends[++*bend]);
    return out;
  }
  while (*bend > 0) {
    auto less = smoothed(kBends[*bend - 1]);
    if (!less.is_smooth()) break;
    out = std::move(less), --*bend;
  }
  return out;
}

}  // namespace veneer::planner
