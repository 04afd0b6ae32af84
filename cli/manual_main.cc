// veneerctl-manual FOLDER: writes veneerctl's man pages (man1/) and its completion for bash (veneerctl). Part of the
// build; nobody needs it afterwards.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "cli/command_tree.h"
#include "cli/manual.h"
#include "cli/map_command.h"
#include "cli/mount_command.h"
#include "cli/plan_command.h"
#include "cli/series_command.h"

namespace {

veneer::Status write_all(const std::filesystem::path& folder) {
  CLI::App app("Runs a scan-to-cut cell for computational parquetry", "veneerctl");
  veneer::cli::CommandContext context;
  veneer::cli::add_common_options(app, context, VENEER_VERSION);
  veneer::cli::add_cell_tree(app, context);
  veneer::cli::add_plan_command(app);
  veneer::cli::add_series_command(app);
  veneer::cli::add_map_command(app);
  veneer::cli::add_mount_command(app);
  std::filesystem::create_directories(folder / "man1");
  const auto write = [&](const std::string& name, const std::string& text) {
    return veneer::cli::write_file((folder / name).string(), text);
  };
  if (auto status = write("man1/veneerctl.1", veneer::cli::man_page(app, "veneerctl", true)); !status.ok())
    return status;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string name = "veneerctl-" + command->get_name();
    if (auto status = write(fmt::format("man1/{}.1", name), veneer::cli::man_page(*command, name, false)); !status.ok())
      return status;
  }
  return write("veneerctl", veneer::cli::bash_completion(app));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: veneerctl-manual FOLDER\n";
    return veneer::cli::kUnusableArguments;
  }
  if (const auto status = write_all(argv[1]); !status.ok()) {
    std::cerr << "veneerctl-manual: " << status.error().message << "\n";
    return veneer::cli::kWorkFailed;
  }
  return 0;
}
