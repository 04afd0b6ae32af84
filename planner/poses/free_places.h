// FreeWood::on_free_wood() for one patch at many poses: what is the same at all of them is worked out once.
//
// An outline that is not convex is grown once and laid where it is asked about, not grown anew there. Growing rounds to
// whole micrometres, so a place that a little more or less growth would decide is left to FreeWood itself, as are all
// places of an outline of which rounding decides whether a corner grows pointed or blunt. Immutable; thread-safe.
#pragma once

#include <vector>

#include "planner/matching/matcher.h"
#include "planner/poses/footprint.h"

namespace veneer::planner {

class FreePlaces {
 public:
  // All outlive this. The panels share one border.
  FreePlaces(const Ring<ArtworkFrame>& outline, const Footprint& footprint, const std::vector<MatchPanel>& panels);

  bool on_free_wood(const Pose& at) const;
  // Where on_free_pixels is known already: what else on_free_wood() asks.
  bool clear_of_settled(const Pose& at) const;

 private:
  using Rings = std::vector<Ring<PanelFrame>>;  // from the centre, not turned
  const FreeWood& wood(const Pose& at) const { return (*panels_)[static_cast<std::size_t>(at.panel)].wood; }
  Ring<PanelFrame> laid(const Pose& at) const { return footprint_->panel_from_artwork(at) * *outline_; }

  const Ring<ArtworkFrame>* outline_;
  const Footprint* footprint_;
  const std::vector<MatchPanel>* panels_;
  Rings narrow_, wide_;  // grown by a little less and a little more than the border; none: FreeWood is asked
};

}  // namespace veneer::planner
