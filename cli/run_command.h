// laser run FILE.
#pragma once

#include "cli/command_context.h"

namespace veneer::cli {

void add_run_command(CLI::App& laser, CommandContext& context);

}  // namespace veneer::cli
