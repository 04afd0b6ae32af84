// Where a new panel gets its tags and through-holes: the plan that the printed sheet shows (fiducial_sheet.h).
//
// Tags need not sit exactly where the plan has them: the first scan measures them. Holes must not be mistaken for one
// another whichever way the panel lies, since they tie its back to its show face (docs/FRAMES.md): all distances
// between two of them differ by kHoleTell or more.
#pragma once

#include <vector>

#include "base/face.h"
#include "base/geometry.h"
#include "base/result.h"

namespace veneer::calib {

inline constexpr Millimetres kPanelTagSize{14};   // black square
inline constexpr Millimetres kPanelHole{6};       // diameter
inline constexpr Millimetres kFiducialInset{13};  // from the board's edge to a tag's or a hole's centre
inline constexpr Millimetres kHoleTell{8};

struct PlannedTag {
  int id = -1;
  Face face = Face::kShow;
  Point<PanelFrame> centre{};  // of a back tag as well: seen from the show face, through the panel
};

struct FiducialPlan {
  Millimetres width{0}, height{0};  // of the board
  std::vector<PlannedTag> tags;     // the show face's first; upright on the face they are glued on
  std::vector<Point<PanelFrame>> holes;

  int first_id() const { return tags.front().id; }
  int next_id() const { return tags.back().id + 1; }
};

// Tags `first_id`, `first_id` + 1, ... in the rim that stays free of veneer, at most some 95 mm apart.
// kInvalidArgument: the board is too small for fiducials (a side under 120 mm), or the family of tags ends before the
// panel has all of its own.
Result<FiducialPlan> plan_fiducials(Millimetres width, Millimetres height, int first_id);

// The least by which two of the distances between the points differ; infinite with fewer than three points.
Millimetres least_difference_of_distances(const std::vector<Point<PanelFrame>>& points);

}  // namespace veneer::calib
