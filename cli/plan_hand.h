// The maker's hand on the command line: which pieces of an earlier plan stay, move or change places.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "planner/plan.h"

namespace veneer::cli {

struct HandArguments {
  std::string keep;
  std::vector<std::string> pins, replanned, swaps, takes, forbidden;
};

void add_hand_arguments(CLI::App& command, HandArguments& arguments);

// Takes forbidden wood out of the stock and fills in PlanOptions::kept.
Status apply_hand(const HandArguments& arguments, std::vector<planner::StockPanel>& stock,
                  planner::PlanOptions& options);

}  // namespace veneer::cli
