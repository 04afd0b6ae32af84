// Whether a new sheet is one that is in stock already: its holes lie as that one's, one way round or the other. Pure.
#pragma once

#include <map>
#include <vector>

#include "base/ids.h"
#include "daemon/orders/scan_work.h"

namespace veneer::daemon {

// "same-sheet" or "wrong-face", of the first such panel; nothing where there is none.
std::vector<ScanWarning> doubts_about_sheet(const calib::PanelFiducials& sheet,
                                            const std::map<PanelId, calib::PanelFiducials>& stock);

}  // namespace veneer::daemon
