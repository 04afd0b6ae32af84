// veneerctl: the command line of a veneerd cell.
#include <CLI/CLI.hpp>

#include "cli/command_context.h"
#include "cli/plan_command.h"
#include "cli/series_command.h"

namespace {

int run(int argc, char** argv) {
  CLI::App app("Runs a scan-to-cut cell for computational parquetry", "veneerctl");
  app.require_subcommand(1);
  app.fallthrough();
  app.set_version_flag("--version", VENEER_VERSION);
  veneer::cli::CommandContext context;
  app.add_option("--socket", context.socket, "Where veneerd listens: a socket's path, or HOST:PORT")
      ->envname("VENEERD_SOCKET")
      ->capture_default_str();
  app.add_flag("--json", context.json, "Print JSON");
  veneer::cli::add_cell_commands(app, context);
  veneer::cli::add_panel_commands(app, context);
  veneer::cli::add_job_commands(app, context);
  veneer::cli::add_laser_commands(app, context);
  veneer::cli::add_recipe_commands(app, context);
  veneer::cli::add_sim_commands(app, context);
  veneer::cli::add_plan_command(app);
  veneer::cli::add_series_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& ended) {  // a command that failed and has said why
    return ended.get_exit_code();
  } catch (const CLI::ParseError& wrong) {  // also --help, which is no error
    return app.exit(wrong) == 0 ? 0 : veneer::cli::kUnusableArguments;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return run(argc, argv); }
