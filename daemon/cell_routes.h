// Binds the API's operations to the cell. The handlers run on the reactor and hand slow work to the workers.
#pragma once

#include "daemon/api/router.h"
#include "daemon/cell.h"

namespace veneer::daemon {

// `cell` outlives the router.
void bind_unit_routes(Router& router, Cell& cell);   // status, commands, the bed's picture
void bind_stock_routes(Router& router, Cell& cell);  // scans, panels, calibration, certificates
void bind_job_routes(Router& router, Cell& cell);

// STOP: the reset byte goes out before the reply is made.
ApiReply stop_at_once(Cell& cell, const Caller& caller);

}  // namespace veneer::daemon
