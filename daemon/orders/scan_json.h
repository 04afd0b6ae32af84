// Scans as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/records_json.h"
#include "daemon/orders/scan_work.h"

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ViewScan, file, name, nominal)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RegisterScans, views, files, scanner, face, known, foreign_tags, width, height, maps,
                                   wood_masks, told_gone, earlier_map, earlier_mask, gone, held, suspects, retag,
                                   edge_margin, round_margin)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanWarning, name, text)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ScanView, tile, warnings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PanelRead, rms, max, fiducials, sheet, lattices, zones, asked, edge_margin,
                                   round_margin, usable, differences, suspects_gone, lost, gained, warnings, new_tags,
                                   left_out)

}  // namespace veneer::daemon
