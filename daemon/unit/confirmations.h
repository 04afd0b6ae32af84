// What an operator confirms by name before the beam comes on. Pure.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"

namespace veneer::daemon {

// kRefused, naming what is missing, unless everything of `wanted` is among what was confirmed.
Status check_confirmed(const std::vector<std::string>& wanted, const std::vector<std::string>& confirmed);

}  // namespace veneer::daemon
