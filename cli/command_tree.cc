#include "cli/command_tree.h"

#include <cstdlib>

namespace veneer::cli {

void add_common_options(CLI::App& app, CommandContext& context, const char* version) {
  app.require_subcommand(1);
  app.fallthrough();
  app.set_version_flag("--version", version);
  app.add_option("--socket", context.socket,
                 "Where veneerd listens: a socket's path, HOST:PORT, or https://HOST:PORT on another machine")
      ->envname("VENEERD_SOCKET")
      ->capture_default_str();
  app.add_option("--ca", context.authority, "Believe this certificate (PEM) of a cell on another machine, and no other")
      ->envname("VENEERD_CA");
  if (const char* token = std::getenv("VENEERD_TOKEN")) context.token = token;  // NOLINT(concurrency-mt-unsafe)
  app.add_flag("--json", context.json, "Print JSON");
}

void add_cell_tree(CLI::App& app, CommandContext& context) {
  add_cell_commands(app, context);
  add_panel_commands(app, context);
  add_fiducial_commands(app, context);
  add_job_commands(app, context);
  add_piece_commands(app, context);
  add_laser_commands(app, context);
  add_bed_commands(app, context);
  add_scanner_commands(app, context);
  add_camera_commands(app, context);
  add_device_commands(app, context);
  add_recipe_commands(app, context);
  add_fact_commands(app, context);
  add_sim_commands(app, context);
}

}  // namespace veneer::cli
