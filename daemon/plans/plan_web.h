// The web of wood that a plan was made with (planner::PlanOptions::web), looked at once more before its wood is
// reserved: other wood may have been allocated since, and the database itself only refuses wood that overlaps.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "db/plans.h"

namespace veneer::daemon {

// kConflict names the first piece that is nearer to allocated wood than the web. `options_json` is the plan's; a plan
// without a web may touch what it likes. What `plan` leases itself does not count. On the database's thread, in the
// same call as the reservation.
Status keeps_web(Repositories& repositories, const std::string& options_json,
                 const std::vector<db::PlannedPatch>& pieces, db::PlanId plan = {});

}  // namespace veneer::daemon
