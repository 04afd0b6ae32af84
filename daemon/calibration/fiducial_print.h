// Prints what marks panels and calibrates the cell: the AprilGrid, and the tags and drilling marks of new panels.
// Pure; thread-safe.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "calib/fiducial_sheet.h"
#include "planner/pages/printed_page.h"

namespace veneer::daemon {

// All pages, which are of one size, as one PDF; of SVG and PNG, which have one page, the first. At least one page.
// kInvalidArgument: a tag that the family does not have.
Result<std::string> print_sheets(const std::vector<calib::FiducialSheet>& pages, planner::PageFormat format);

}  // namespace veneer::daemon
