// veneerctl-plan: the commands of veneerctl that plan without a cell. veneerctl runs it in its own place.
#include <CLI/CLI.hpp>

#include "cli/command_context.h"
#include "cli/map_command.h"
#include "cli/mount_command.h"
#include "cli/plan_command.h"
#include "cli/series_command.h"

int main(int argc, char** argv) {
  CLI::App app("Plans pictures from wood", "veneerctl");
  app.require_subcommand(1);
  veneer::cli::add_plan_command(app);
  veneer::cli::add_series_command(app);
  veneer::cli::add_map_command(app);
  veneer::cli::add_mount_command(app);
  return veneer::cli::run(app, argc, argv);
}
