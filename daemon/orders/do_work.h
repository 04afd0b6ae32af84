// Every kind of work that worker processes do, by its word.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// All but scanning (capture_work.h) ends with its process and looks at no `stop`. kInvalidArgument: there is no such
// work, or the request is not one of that work. May throw what libraries throw.
Result<nlohmann::json> do_work(const std::string& kind, const nlohmann::json& request,
                               const std::filesystem::path& folder, const TaskProgress& progress,
                               const std::stop_token& stop);

}  // namespace veneer::daemon
