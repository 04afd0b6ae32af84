// Binds the API's operations to the cell. The handlers run on the reactor and hand slow work to the workers.
#pragma once

#include "daemon/api/router.h"
#include "daemon/cell.h"

namespace veneer::daemon {

// `cell` outlives the router.
void bind_unit_routes(Router& router, Cell& cell);   // status, commands, the bed's picture
void bind_stock_routes(Router& router, Cell& cell);  // scans, panels, calibration, certificates
void bind_job_routes(Router& router, Cell& cell);
void bind_laser_routes(Router& router, Cell& cell);   // test pattern, jog, overrides
void bind_recipe_routes(Router& router, Cell& cell);  // recipes, the wood of zones, test cards, cut files

// A list of texts in a request's body; empty when it is not there, kInvalidArgument when it is something else.
Result<std::vector<std::string>> texts_in(const nlohmann::json& body, const char* name);
// What the operator confirms before the beam comes on: {"confirmed": ["exhaust", ...]}.
Result<std::vector<std::string>> confirmed_in(const nlohmann::json& body);

// STOP: the reset byte goes out before the reply is made.
ApiReply stop_at_once(Cell& cell, const Caller& caller);

}  // namespace veneer::daemon
