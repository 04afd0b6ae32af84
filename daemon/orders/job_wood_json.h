// The wood of a job as JSON between the daemon and its worker processes, for the few sources that write or read it.
#pragma once

#include "daemon/orders/job_wood.h"
#include "daemon/orders/records_json.h"

namespace veneer::planner {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ForbiddenWood, panel, region)

}  // namespace veneer::planner

namespace veneer::daemon {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(HeldPanel, id, map, mask, live, zones, spared, mask_now, own, closed, remnant)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(JobWood, panels, margin, woods, wood_weights, wood_limits, forbidden, max_panels,
                                   remnants_first, index_dir)

}  // namespace veneer::daemon
