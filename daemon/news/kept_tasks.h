// Tasks as JSON, for the file that lets what came of them outlive the daemon, and their numbers go on. Pure.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "daemon/api/tasks.h"
#include "daemon/news/untold_failures.h"

namespace veneer::daemon {

struct KeptTasks {
  std::int64_t last_id = 0;
  std::vector<TaskView> tasks;       // oldest first; none of them runs
  std::vector<TaskView> unfinished;  // of those, what was under way when the daemon ended: failed now, saying so
  std::vector<UntoldFailures::Kept> untold;
};

// Results up to this length are kept whole; of a longer one what its event told (TaskResult::brief).
inline constexpr std::size_t kLongestKeptResult = 16 * 1024;

nlohmann::json tasks_to_json(std::int64_t last_id, const std::vector<TaskView>& tasks,
                             const std::vector<UntoldFailures::Kept>& untold = {});
// None of what no such tasks were written to.
std::optional<KeptTasks> tasks_from_json(const nlohmann::json& json);

}  // namespace veneer::daemon
