// Gives every group of routes what it needs of the cell.
#pragma once

#include "daemon/api/router.h"
#include "daemon/cell.h"

namespace veneer::daemon {

// `cell` outlives the router.
void bind_routes(Router& router, Cell& cell);

}  // namespace veneer::daemon
