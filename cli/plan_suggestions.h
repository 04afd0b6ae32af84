// `veneerctl plan --suggest`: advice instead of a plan.
#pragma once

#include <string>

#include "cli/plan_arguments.h"
#include "cli/plan_edits.h"

namespace veneer::cli {

// Writes suggestions.png (the contact sheet), suggestions.json and a preview-N.png for each into `out`, and says on
// stdout what the sheet says, with the command that plans each. `given`: the options of `plan` that were named, as they
// stand on the command line, but for those that a suggestion decides. Ends the command when something is wrong.
void run_suggest(const PlanArguments& arguments, const EditArguments& edits, const std::string& given,
                 const std::string& out);

}  // namespace veneer::cli
