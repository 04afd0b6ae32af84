// What `veneerctl plan` and `veneerctl series` are told: pictures, panels and options, read and checked.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "base/result.h"
#include "cli/layout_files.h"
#include "planner/plan.h"

namespace veneer::cli {

struct PlanArguments {
  std::vector<std::string> targets, crops, panels, woods, wood_weights, material_limits;
  LayoutFiles files;
  double size_mm = 360, kerf_mm = 0.15, web_mm = 0;
  int copies = 1;
  planner::PlanOptions options;  // kerf, web and limits of materials are filled in by plan_options()
};

// Adds the options that both commands share.
void add_plan_arguments(CLI::App& command, PlanArguments& arguments);

// Checks what make_plan does not; threads are counted.
Result<planner::PlanOptions> plan_options(const PlanArguments& arguments);
Result<std::vector<planner::StockPanel>> load_panels(const PlanArguments& arguments);
// Every target `copies` times, in turn: all targets, then all again.
Result<std::vector<planner::Artwork>> load_artworks(const PlanArguments& arguments);

}  // namespace veneer::cli
