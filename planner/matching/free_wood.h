// Which wood of one panel may still be taken, exactly.
//
// Two rules, for an outline grown by the kerf (and, towards wood that was never free, by the position margin):
//   it touches no pixel square of the stock raster that is not free, and lies within the raster;
//   it does not overlap the grown outline of an earlier placement (touching is allowed).
// A web that is to stay around the kerf comes as half of it in the kerf, half in the margin (PlanOptions::web).
// Both work on the polygons themselves, not on rotated masks. kSlack keeps them stricter than the ledger's arithmetic
// on whole micrometres. Outlines are simple polygons, counter-clockwise: convex ones are grown with pointed corners and
// compared by their sides; all others are grown and intersected as the ledger does it (base/polygon_ops.h), which takes
// some tenths of a millisecond where outlines lie close. Not thread-safe while allocate() runs.
#pragma once

#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "base/polygon_ops.h"
#include "planner/stock.h"

namespace veneer::planner {

class FreeWood {
 public:
  // What rounding to whole micrometres can move a corner by, several times over.
  static constexpr Millimetres kSlack{0.004};

  FreeWood(const Raster<PanelFrame>& free, Millimetres kerf, Millimetres position_margin);

  // Whether the outline (counter-clockwise) can be cut here.
  bool admits(const Ring<PanelFrame>& outline) const;
  // Whether it can by the ledger's own arithmetic between neighbours, without the slack that new places keep: what was
  // admitted one after the other is admitted again in any order.
  bool admits_again(const Ring<PanelFrame>& outline) const;
  // Whether it could be cut here from untouched() wood.
  bool on_free_wood(const Ring<PanelFrame>& outline) const;
  // The two halves of that: of rings (even-odd) that are grown by border() already, and of an outline.
  bool touches_only_free(const std::vector<Ring<PanelFrame>>& rings) const;
  bool has_settled() const { return settled_ > 0; }
  bool collides_with_settled(const Ring<PanelFrame>& outline) const { return collides_with(outline, settled_); }
  // Only the second rule: against what allocate() has taken.
  bool collides(const Ring<PanelFrame>& outline) const;
  // Takes the wood of an admitted outline.
  void allocate(const Ring<PanelFrame>& outline);

  // From now on all that is allocated counts as gone from the start.
  void settle() { settled_ = allocations_.size(); }
  // The same wood as it was at the start.
  FreeWood untouched() const;

  const Raster<PanelFrame>& raster() const { return free_; }
  Millimetres kerf() const { return kerf_; }
  // The growth that counts towards wood that was never free.
  Millimetres border() const { return kerf_ + margin_ + kSlack; }

 private:
  struct Allocation {
    bool convex;
    std::vector<Ring<PanelFrame>> grown;
    Box<PanelFrame> box;
    Region<PanelFrame> region;  // as the ledger will book it
  };
  bool on_free_pixels(const Ring<PanelFrame>& outline) const;
  bool collides_with(const Ring<PanelFrame>& outline, std::size_t count) const;
  bool any_blocked(int row, int first, int last) const;  // columns first to last

  Raster<PanelFrame> free_;
  Millimetres kerf_, margin_;
  std::vector<Allocation> allocations_;
  std::size_t settled_ = 0;  // how many of them
};

// A counter-clockwise outline with every side moved outwards by `by`: one ring with mitred corners if it is convex;
// else the ledger's, which may have several where a notch closes. Even-odd.
std::vector<Ring<PanelFrame>> grown_rings(const Ring<PanelFrame>& outline, Millimetres by);

// A convex counter-clockwise outline with every side moved outwards by `by`; corners are mitred.
Ring<PanelFrame> grown(const Ring<PanelFrame>& outline, Millimetres by);

// Whether two convex counter-clockwise outlines share more than a border.
bool convex_overlap(const Ring<PanelFrame>& a, const Ring<PanelFrame>& b);

}  // namespace veneer::planner
