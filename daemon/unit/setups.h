// How a panel is laid on the bed, and which of its pieces are cut then: once for a panel that fits, in several set-ups
// for one that is larger than the bed. Pure; deterministic; thread-safe.
//
// Every piece belongs to exactly one set-up. A set-up's pieces lie within the machine's reach and at least three
// fiducials of the upward face, none of them cut through by an earlier set-up, lie within the camera's view; both with
// `slack` to spare, since hands lay the panel. Directions are as the operator sees the bed: right, left, front (towards
// the operator) and back. A panel may stick out over the bed's edge.
#pragma once

#include <string>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "base/result.h"

namespace veneer::daemon {

struct SetupPiece {
  PieceId piece;
  Ring<PanelFrame> outline;  // all that its cut may burn: with its kerf and lead-in
};

struct SetupInput {
  PanelId panel;
  Millimetres width{0}, height{0};  // of the panel; its lower left corner is the origin of PanelFrame
  std::vector<SetupPiece> pieces;
  std::vector<Ring<PanelFrame>> fiducials;  // of the upward (back) face, on wood that is still whole
  Box<BedFrame> reach;                      // where the beam may go
  Box<BedFrame> view;                       // what the camera sees at the panel's height
  Millimetres slack{8};                     // how far from the planned place hands may lay it
};

struct PanelSetup {
  std::vector<PieceId> pieces;                     // in the order they were given
  Isometry2<BedFrame, PanelFrame> bed_from_panel;  // about so, back up; the camera measures what it really is
  std::string how;                                 // "" when it may lie any way; else how to lay it
};

// Never empty. kRefused, naming the panel, when no sequence of set-ups reaches all pieces.
Result<std::vector<PanelSetup>> plan_setups(const SetupInput& input);

}  // namespace veneer::daemon
