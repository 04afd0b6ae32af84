// report.json: what planning did and how it came out (docs/FILES.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "planner/plan.h"

namespace veneer::planner {

struct ReportSeconds {
  double load = 0, total = 0;
};
// What the assembled previews say, all together; none when no piece has wood.
struct PreviewFigures {
  std::optional<double> cost_per_pixel;   // preview.h
  std::optional<double> grain_coherence;  // grain/grain_coherence.h
};
std::string report_to_json(const Plan& plan, const ReportSeconds& seconds, std::int64_t peak_rss_bytes, int threads,
                           const PreviewFigures& previews = {});

}  // namespace veneer::planner
