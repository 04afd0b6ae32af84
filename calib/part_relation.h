// Where a part lay in the panel that it was sawn from, measured on the tags and holes that both know. Pure;
// thread-safe.
#pragma once

#include "base/frames.h"
#include "base/result.h"
#include "base/units.h"
#include "calib/fiducials.h"

namespace veneer::calib {

struct PartRelationOptions {
  Millimetres max_rms{0.05};    // of the places of corners and centres, as of a scan on frozen fiducials
  Millimetres max_single{0.1};  // of one of them
  Millimetres hole_reach{0.5};  // a hole counts as the same one when the tags lay it this near
  // What the relation may be wrong by in the part's farthest corner: half of the margin that is left to each cut.
  Millimetres max_doubt{0.1};
  Millimetres place_doubt{0.03};  // of one tag or hole between two scans, at least
};

struct PartRelation {
  Isometry2<PanelFrame, PanelFrame> part_from_parent;  // proper
  int fiducials = 0;                                   // of the parent, that are still on the part
  Millimetres rms{0};
  Millimetres doubt{0};  // in the part's farthest corner
};

// `part` and `parent` each in its own frame, `sheet` the part's bounding box. Tags of the show face are told by their
// ids; without one in common, at least three holes by how they lie to each other.
// kRefused, with what to do: too few in common, or so close together that they fix the part's corners badly; places
// that do not agree (a tag was glued anew, or is another one of the same number).
Result<PartRelation> relate_part(const PanelFiducials& part, const PanelFiducials& parent, const Box<PanelFrame>& sheet,
                                 const PartRelationOptions& options = {});

}  // namespace veneer::calib
