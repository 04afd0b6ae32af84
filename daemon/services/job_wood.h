// The wood that a new job may use: free wood of the panels and kinds it asks for.
#pragma once

#include <vector>

#include "base/result.h"
#include "daemon/database_thread.h"
#include "daemon/services/job_request.h"
#include "daemon/services/panel_library.h"
#include "planner/stock.h"

namespace veneer::daemon {

// Mask minus live allocations grown by `margin`. With `woods` a panel offers its zones of these materials only, and
// none of the wood that another zone may reach into; its species is the one material it offers, "" when there are
// several or nobody has said. Forbidden wood is not free. Indexes of panels that are used up or gone are dropped.
//
// Blocks on the database and on files. kNotFound: a panel is not in stock, or not among those asked for and wood on it
// is forbidden. kInvalidArgument: no panel has a wood that is asked for or weighed; forbidden wood lies beside its
// panel. kRefused: there is no panel.
Result<std::vector<planner::StockPanel>> load_job_wood(DatabaseThread& database, const PanelLibrary& library,
                                                       const JobRequest& request, Millimetres margin);

}  // namespace veneer::daemon
