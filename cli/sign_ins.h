// Where veneerctl keeps what `veneerctl login` opened, for the next command: a file that only its owner reads, in
// $XDG_CONFIG_HOME/veneerctl or ~/.config/veneerctl.
#pragma once

#include <string>

#include "base/result.h"

namespace veneer::cli {

// Of a daemon by its address ("https://cell.example:8443"); "" when there is none.
std::string kept_secret(const std::string& address);
// An empty secret forgets it.
Status keep_secret(const std::string& address, const std::string& secret);

}  // namespace veneer::cli
