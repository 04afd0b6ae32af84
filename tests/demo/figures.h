// The figures the demo must show (docs/FILES.md), and which of them a report misses.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace veneer::tests {

// One sentence for each figure that is red or null: "jobs[0].picture_ssim = 0.91, must be at least 0.95".
std::vector<std::string> red_figures(const nlohmann::json& report);

}  // namespace veneer::tests
