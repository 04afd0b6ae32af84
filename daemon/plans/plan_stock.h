// What the database knows of the wood that a plan may use, read in one go: as it is today, or as a job found it.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/orders/plan_work.h"
#include "daemon/stock/panel_library.h"
#include "daemon/store/database_thread.h"
#include "db/plans.h"

namespace veneer::daemon {

struct PlanStock {
  std::vector<HeldPanel> held;
  std::vector<db::PlannedPanel> planned_on;  // a panel that is scanned meanwhile is noticed when wood is reserved
  std::vector<PanelId> in_stock;
  std::vector<std::pair<PanelId, std::string>> left_out;  // and what is to be done first
  std::set<PanelId> not_used;                             // left out, retired, or others were asked for
  std::vector<db::RecipeRecord> recipes;
};

// The panels `wanted`, or all when there are none. What the plan `own` leases counts as free. kNotFound, kRefused: one
// of them, or all there are, cannot be used, and why.
Result<PlanStock> read_stock(Repositories& r, const std::vector<PanelId>& wanted, const PanelLibrary& library,
                             std::optional<db::PlanId> own);

// The panels of `stock` as the job found them, those among them that are out of stock by now too, and what is left of
// them.
Status hold_as_planned(Repositories& r, const PanelLibrary& library, const db::JobRecord& job, PlanStock& stock);

}  // namespace veneer::daemon
