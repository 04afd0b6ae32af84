// What --guides takes: a picture of the edges that count, or a JSON file that names such pictures and pinned vertices
// (docs/FILES.md).
#pragma once

#include <filesystem>

#include "base/result.h"
#include "planner/layout/layout_guides.h"

namespace veneer::cli {

// kInvalidArgument: it is no such file; which vertices the grid has, the planner says. Pictures that a JSON file names
// are looked for beside it.
Result<planner::LayoutGuides> load_guides(const std::filesystem::path& file);

}  // namespace veneer::cli
