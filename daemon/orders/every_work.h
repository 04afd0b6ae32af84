// All kinds of work: the one list of what veneer-worker does. The campaign of its faults takes its kinds from here
// (tests/scenarios/workers_test.cc).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

std::vector<std::string> kinds_of_work();

// Errors: do_work_of() in kind_of_work.h. May throw what libraries throw.
Result<nlohmann::json> do_any_work(const std::string& kind, const nlohmann::json& request,
                                   const std::filesystem::path& folder, const TaskProgress& progress,
                                   const std::stop_token& stop);

}  // namespace veneer::daemon
