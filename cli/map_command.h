// `veneerctl map`: the map by which a planned artwork is put together, to be printed (docs/FILES.md).
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "cli/command_context.h"

namespace veneer::cli {

// How a map is to look, as its options are written; `job map` has them too.
struct MapArguments {
  std::string view = "back", scale = "fit", paper = "a4", out;
};
// --view, --scale, --paper and --out FILE.pdf|.svg|.png.
void add_map_arguments(CLI::App& command, MapArguments& arguments);
// "pdf", "svg" or "png", by the file's ending. Ends the command (2) with another one.
std::string map_format(const MapArguments& arguments);

// Adds `job map`: the same of a job, drawn by the daemon.
void add_job_map(CLI::App& job, CommandContext& context);

// Adds `map`. It ends as `plan` does (plan_command.h).
void add_map_command(CLI::App& app);

}  // namespace veneer::cli
