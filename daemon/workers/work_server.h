// The inside of a worker process: takes one order, confines itself, does the work, answers, ends.
//
// The words are worker_processes.h's. The process ends with the one that started it: the kernel kills it when the
// thread that started it ends, and it ends itself when nobody holds the other end of its requests. Anything that comes
// there behind the order tells it to end what it does: it has WorkOrder::grace for that.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

inline constexpr int kWorkRequests = 0;  // descriptors; standard output goes where standard error goes
inline constexpr int kWorkAnswers = 3;

// May throw; std::bad_alloc is told as what it is.
using DoWork = std::function<Result<nlohmann::json>(const std::string& kind, const nlohmann::json& request,
                                                    const std::filesystem::path& folder, const TaskProgress& progress,
                                                    const std::stop_token& stop)>;

// Call it first thing in main(), before there is another thread; does not return.
[[noreturn]] void serve_work(const DoWork& work);

}  // namespace veneer::daemon
