// All commands of veneerctl, as one tree.
#pragma once

#include <CLI/CLI.hpp>
#include <array>

#include "cli/command_context.h"

namespace veneer::cli {

// The planner is a program of its own beside this one, with some hundred libraries: STOP does not wait for them.
struct PlannerCommand {
  const char* name;
  const char* help;
};
inline constexpr std::array kPlannerCommands = {
    PlannerCommand{"plan", "Plan pictures from panels, without a cell"},
    PlannerCommand{"series", "Plan a picture again and again from the same wood"},
    PlannerCommand{"map", "Draw the map by which a planned picture is put together"},
    PlannerCommand{"mount", "Draw back plate, tray and frame for a planned picture"},
};

// What stands before the commands: --socket, --json, --version.
void add_common_options(CLI::App& app, CommandContext& context, const char* version);
// Every command but the planner's.
void add_cell_tree(CLI::App& app, CommandContext& context);

}  // namespace veneer::cli
