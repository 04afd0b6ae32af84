// `veneerctl series`: the same picture again and again from the same wood (paper, figure 14).
#pragma once

#include <CLI/CLI.hpp>

namespace veneer::cli {

// Adds `series`. Ends as `plan` does (plan_command.h).
void add_series_command(CLI::App& app);

}  // namespace veneer::cli
