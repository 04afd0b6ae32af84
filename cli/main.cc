// veneerctl: the command line of a veneerd cell.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <iostream>
#include <string_view>

#include "cli/command_context.h"

namespace {

// The planner is a program of its own beside this one, with some hundred libraries: STOP does not wait for them.
struct PlannerCommand {
  const char* name;
  const char* help;
};
constexpr std::array kPlannerCommands = {
    PlannerCommand{"plan", "Plan pictures from panels, without a cell"},
    PlannerCommand{"series", "Plan a picture again and again from the same wood"},
};

int run_planner(char** argv) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "veneerctl-plan";
  ::execv(program.c_str(), argv);
  std::cerr << "veneerctl: " << program.string() << " is not there: install it beside veneerctl" << std::endl;
  return veneer::cli::kWorkFailed;
}

// For --help; they are run before anything is parsed.
void name_planner_commands(CLI::App& app) {
  for (const PlannerCommand& command : kPlannerCommands)
    app.add_subcommand(command.name, command.help)->allow_extras()->callback([name = command.name] {
      veneer::cli::fail(
          {veneer::ErrorCode::kInvalidArgument, std::string("write veneerctl ") + name + " first, then options"},
          veneer::cli::kUnusableArguments);
    });
}

// STOP does not wait either until a hundred other commands have been described.
bool asks_to_stop(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--socket")
      ++i;
    else if (argument != "--json" && !argument.starts_with("--socket="))
      return argument == "stop";
  }
  return false;
}

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
  if (asks_to_stop(argc, argv)) {
    veneer::cli::add_stop_command(app, context);
    return veneer::cli::run(app, argc, argv);
  }
  veneer::cli::add_cell_commands(app, context);
  veneer::cli::add_panel_commands(app, context);
  veneer::cli::add_fiducial_commands(app, context);
  veneer::cli::add_job_commands(app, context);
  veneer::cli::add_piece_commands(app, context);
  veneer::cli::add_laser_commands(app, context);
  veneer::cli::add_scanner_commands(app, context);
  veneer::cli::add_recipe_commands(app, context);
  veneer::cli::add_fact_commands(app, context);
  veneer::cli::add_sim_commands(app, context);
  name_planner_commands(app);
  return veneer::cli::run(app, argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  for (const PlannerCommand& command : kPlannerCommands)
    if (argc > 1 && std::string_view(argv[1]) == command.name) return run_planner(argv);
  return run(argc, argv);
}
