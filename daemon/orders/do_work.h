// Every kind of work that worker processes do, by its word.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// kInvalidArgument: there is no such work, or the request is not one of that work. May throw what libraries throw.
Result<nlohmann::json> do_work(const std::string& kind, const nlohmann::json& request,
                               const std::filesystem::path& folder, const TaskProgress& progress);

}  // namespace veneer::daemon
