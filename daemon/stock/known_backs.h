// A panel lies on the bed back up, and the camera finds it by the tags there: wood of a panel whose back nobody scanned
// cannot be cut.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "db/plans.h"

namespace veneer::daemon {

// The sentence for whoever wants wood of `panel`.
std::string scan_its_back(const PanelId& panel);

// kRefused names the first panel whose back is unknown. On the database's thread.
Status backs_are_known(Repositories& repositories, const std::vector<db::PlannedPanel>& panels);

}  // namespace veneer::daemon
