// What worker processes compute, by its word: all kinds of work but those that need devices or the network.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/orders/kind_of_work.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

std::span<const KindOfWork> computed_work();

// One of them. It ends with its process and looks at no `stop`. Errors: do_work_of() in kind_of_work.h.
Result<nlohmann::json> do_work(const std::string& kind, const nlohmann::json& request,
                               const std::filesystem::path& folder, const TaskProgress& progress,
                               const std::stop_token& stop);

}  // namespace veneer::daemon
