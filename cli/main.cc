// veneerctl: the command line of a veneerd cell.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <string_view>

#include "cli/command_tree.h"

namespace {

using veneer::cli::kPlannerCommands;
using veneer::cli::PlannerCommand;

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
    if (argument == "--socket" || argument == "--ca")
      ++i;
    else if (argument != "--json" && !argument.starts_with("--socket=") && !argument.starts_with("--ca="))
      return argument == "stop";
  }
  return false;
}

int run(int argc, char** argv) {
  CLI::App app("Runs a scan-to-cut cell for computational parquetry", "veneerctl");
  veneer::cli::CommandContext context;
  veneer::cli::add_common_options(app, context, VENEER_VERSION);
  if (asks_to_stop(argc, argv)) {
    veneer::cli::add_stop_command(app, context);
    return veneer::cli::run(app, argc, argv);
  }
  veneer::cli::add_cell_tree(app, context);
  name_planner_commands(app);
  return veneer::cli::run(app, argc, argv);
}

}  // namespace

int main(int argc, char** argv) {
  for (const PlannerCommand& command : kPlannerCommands)
    if (argc > 1 && std::string_view(argv[1]) == command.name) return run_planner(argv);
  return run(argc, argv);
}
