// A patch's outline as something that lies on wood: where it is put, and whether two of them get in each other's way.
//
// Footprints are outlines grown by the kerf and by FreeWood::kSlack, so that two that do not overlap keep to the rule
// of free_wood.h whichever is placed first. A concave one is a few convex parts, which reach up to kConcaveSlack
// farther. Lengths are millimetres of PanelFrame. Immutable; thread-safe.
#pragma once

#include <limits>
#include <vector>

#include "base/frames.h"
#include "base/geometry.h"

namespace veneer::planner {

// A rigid motion of a patch on to a panel: where its centre (that of its bounding box) lies, and how it is turned,
// counter-clockwise.
struct Pose {
  int panel = 0;
  double x = 0, y = 0;
  double angle = 0, cos = 1, sin = 0;
  friend bool operator==(const Pose&, const Pose&) = default;
};
Pose pose_at(int panel, double x, double y, double angle);

// A place that is looked at for a patch: a pose that it may take, and what it costs there (equation 4).
struct Candidate {
  Pose pose;
  double cost = std::numeric_limits<double>::infinity();
};
// Cheapest first; equal costs are decided by the pose, so that every sort has one result.
bool cheaper(const Candidate& a, const Candidate& b);

class Footprint {
 public:
  static constexpr Millimetres kConcaveSlack{0.04};

  Footprint(const Ring<ArtworkFrame>& outline, Millimetres growth);

  // Radii about the centre: the largest circle inside, the smallest around.
  double inner() const { return inner_; }
  double outer() const { return outer_; }
  Isometry2<PanelFrame, ArtworkFrame> panel_from_artwork(const Pose& pose) const;
  Pose pose_of(int panel, const Isometry2<PanelFrame, ArtworkFrame>& panel_from_artwork) const;

  // Whether the two share more than a border.
  static bool overlap(const Footprint& a, const Pose& at_a, const Footprint& b, const Pose& at_b);

 private:
  struct Corner {
    double x, y;
  };
  struct Side {
    double x, y, reach;  // outward unit normal, distance from the centre
  };
  struct Part {                   // convex
    std::vector<Corner> corners;  // from the centre
    std::vector<Side> sides;
    Corner middle;  // of the circle around it
    double radius;
  };
  static Part part_of(const std::vector<Corner>& corners);
  // Whether a side of `a` has all of `b` on its outer side, by so much at least.
  static bool separated(const Part& a, const Pose& at_a, const Part& b, const Pose& at_b, double by = 0);

  Point<ArtworkFrame> centre_;
  std::vector<Part> parts_;
  Part hull_;  // of them all
  double inner_ = 0, outer_ = 0;
};

}  // namespace veneer::planner
