// Calibration as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/calibration_work.h"
#include "daemon/orders/shapes_json.h"

namespace veneer {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PatternLayout, area, spacing)

}  // namespace veneer

namespace veneer::calib {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GridView, height, tags)

}  // namespace veneer::calib

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Fit, payload, rms)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReadGridScan, file, nominal)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FitScanner, scans)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReadGridView, file, height)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GridViewRead, view, width_px, height_px)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FitCamera, views, width_px, height_px)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReadPatternView, file, camera, camera_certificate, camera_off, height, pattern,
                                   reach)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ReadPatternScan, file, nominal, scanner, scan_size, pattern)

}  // namespace veneer::daemon
