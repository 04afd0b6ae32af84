// What a worker process does with scanners (capture_order.h). Not confined as others are: it needs devices and the
// network (WorkOrder::devices).
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

// None: this kind of work is another's. May throw what libraries throw.
std::optional<Result<nlohmann::json>> do_capture_work(const std::string& kind, const nlohmann::json& request,
                                                      const std::filesystem::path& folder, const TaskProgress& progress,
                                                      const std::stop_token& stop);

}  // namespace veneer::daemon
