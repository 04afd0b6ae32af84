// `veneerctl mount`: back plate, tray and frame for a finished picture, as cut files (docs/PLANNER.md).
#pragma once

#include <CLI/CLI.hpp>

namespace veneer::cli {

// Adds `mount`. It ends as `plan` does (plan_command.h).
void add_mount_command(CLI::App& app);

}  // namespace veneer::cli
