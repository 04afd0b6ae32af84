// The pictures of a study: of a plan as it came out, of the picture alone, or of a stage between the two.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "tests/gallery/plan_runs.h"

namespace veneer::gallery {

// What a view can show.
const std::vector<std::string>& view_kinds();
// Whether it shows a plan that was made; figures and a command belong to such a view.
bool shows_plan(const std::string& kind);

// CV_8UC3. `name`: of the plan's folder, if it has to be made.
Result<cv::Mat> draw_view(const ViewEntry& view, const std::string& name, Sources& sources, PlanRuns& runs);

}  // namespace veneer::gallery
