// Passwords come from the terminal, where they are not shown, or from standard input, as one line. Never from an
// argument: every user of the machine reads those.
#pragma once

#include <string>

#include "base/result.h"

namespace veneer::cli {

// kInvalidArgument when there is none.
Result<std::string> ask_password(const std::string& prompt);
// Twice at a terminal, so that it is what was meant.
Result<std::string> ask_new_password(const std::string& of);

}  // namespace veneer::cli
