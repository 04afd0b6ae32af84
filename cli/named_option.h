// The planner's options by name as options of a command.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "planner/plan_options.h"

namespace veneer::cli {

// "--patch-mm" for "patch_mm". `take` gets what was given ("1" of a switch) while the command line is parsed, and is
// kept by the command.
CLI::Option* add_named_option(CLI::App& command, const planner::NamedOption& option,
                              std::function<void(const std::string& text)> take);

}  // namespace veneer::cli
