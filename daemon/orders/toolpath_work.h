// What a worker process does to find the beam's way through the pieces of a panel (planner/cutting/toolpath.h):
// geometry and a search for the shortest way, none of which the process that owns the laser should stand or fall by.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "daemon/workers/work_runner.h"
#include "planner/cutting/toolpath.h"

namespace veneer::daemon {

struct LayToolpath {
  static constexpr const char* kKind = "lay_toolpath";
  std::vector<planner::ToolpathPiece> pieces;
  planner::ToolpathOptions options;
};

// As planner::make_toolpath() says. Writes nothing.
Result<planner::Toolpath> lay_toolpath(const LayToolpath& order, const std::filesystem::path& folder,
                                       const TaskProgress& progress);

// Has it done by a process, once more when that died. Blocks; any thread but the reactor. Errors: the same, and
// WorkRunner's.
Result<planner::Toolpath> have_toolpath_laid(WorkRunner& workers, const std::filesystem::path& data_dir,
                                             const LayToolpath& order, const std::stop_token& stop);

}  // namespace veneer::daemon
