// `veneerctl plan`: planning on picture files, with no daemon and no hardware (docs/FILES.md).
#pragma once

#include <CLI/CLI.hpp>

namespace veneer::cli {

// Adds `plan`. Failing, it says why on stderr and throws CLI::RuntimeError with the exit status: 1 the work failed, 2
// the arguments are unusable. Its progress goes to stderr.
void add_plan_command(CLI::App& app);

}  // namespace veneer::cli
