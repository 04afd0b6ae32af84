// report.json: what planning did and how it came out (docs/FILES.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
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
// `settings`: the settings_key() of what was planned (plan_journal.h); "": it is not told.
std::string report_to_json(const Plan& plan, const ReportSeconds& seconds, std::int64_t peak_rss_bytes, int threads,
                           const PreviewFigures& previews = {}, const std::string& settings = {});

// Which of two plans of the same settings is the better one.
struct PlanFigures {
  bool stopped = false;  // before it was whole
  std::size_t unfilled = 0;
  double cost_total = 0;
  struct Together {
    bool stopped = false;
    double cost = 0;
  };
  std::optional<Together> together;  // GlobalReport
};
PlanFigures figures_of(const Plan& plan);
// A whole plan is as good as its settings make it, so one that was stopped is worse. Else fewer pieces without wood
// count first, then the cost that was being lowered: of choosing together while that is not done, then cost_total.
bool is_worse(const PlanFigures& plan, const PlanFigures& than);

struct ReportedPlan {
  std::string settings;
  PlanFigures figures;
};
// Of a report.json; none where there is no such file, or it does not tell them.
std::optional<ReportedPlan> read_report(const std::filesystem::path& path);

}  // namespace veneer::planner
