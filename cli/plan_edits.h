// Changes to an earlier plan on the command line: which of its pieces stay, move or change places.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::cli {

struct EditArguments {
  std::string keep;
  std::vector<std::string> pins, replanned, swaps, takes, forbidden;
};

void add_edit_arguments(CLI::App& command, EditArguments& arguments);
// Of them, wood that is not to be used: for whoever keeps no plan.
void add_forbid_argument(CLI::App& command, EditArguments& arguments);

// Takes forbidden wood out of the stock and fills in PlanOptions::kept.
Status apply_edits(const EditArguments& arguments, std::vector<planner::StockPanel>& stock,
                   planner::PlanOptions& options);

}  // namespace veneer::cli
