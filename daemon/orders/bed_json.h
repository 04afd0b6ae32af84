// What is seen on the bed as JSON between the daemon and its worker processes, for the few sources that write or read
// it.
#pragma once

#include "daemon/orders/bed_work.h"
#include "daemon/orders/shapes_json.h"

namespace veneer::calib {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WantedBoard, width, height, upper_face)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FoundBoard, centre, width, height, turn_deg)

}  // namespace veneer::calib

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BedPanel, panel, fiducials, outline, height)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LookAtBed, file, stock, camera, panels, board, shown_px)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SeenPose, panel, face_up, bed_from_panel, rms, moved_tags)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SeenHoles, panel, seen, known, by_chance)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BedSeen, nothing, tags, boards, holes, pose, why_none, why_code)

}  // namespace veneer::daemon
