// The options with which pieces are cut from a cell's wood: the same for a plan and for the advice before it, or a
// suggestion that fits would be refused when it is taken. Pure; thread-safe.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/orders/job_wood.h"
#include "planner/plan.h"

namespace veneer::daemon {

// planner::kNamedOptions as they are written. The kerf is the widest with which any of `stock`, which was loaded of
// `wood`, is cut: `kerf`, the certificate's, or a recipe's. The web is that of the layout and the borders they name.
// kInvalidArgument: an option cannot be.
Result<planner::PlanOptions> wood_options(const std::map<std::string, std::string>& named, const JobWood& wood,
                                          std::span<const planner::StockPanel> stock, Millimetres kerf,
                                          const std::vector<db::RecipeRecord>& recipes);

// How much wood stays around the kerfs of such pieces.
Millimetres web_of(planner::LayoutKind layout, planner::Refine refine);

}  // namespace veneer::daemon
