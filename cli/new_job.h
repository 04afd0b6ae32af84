// job new: a picture planned from free stock, or a plan that was made before, becomes a job; job plan|plans|change:
// plans that reserve no wood, to be looked at, changed and compared first.
#pragma once

#include "cli/command_context.h"

namespace veneer::cli {

void add_new_job(CLI::App& job, CommandContext& context);
void add_plans(CLI::App& job, CommandContext& context);

}  // namespace veneer::cli
