// A task as clients are told of it.
#pragma once

#include <nlohmann/json.hpp>

#include "daemon/api/tasks.h"

namespace veneer::testing {

inline nlohmann::json json_of(const daemon::TaskView& task) { return nlohmann::json::parse(daemon::to_text(task)); }

}  // namespace veneer::testing
