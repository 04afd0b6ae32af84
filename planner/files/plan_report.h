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
// SHA-256 of pictures, wood and options (settings_key() of plan_journal.h), and of plan.json; "": it is not told.
struct PlanHashes {
  std::string inputs, plan;
};
std::string report_to_json(const Plan& plan, const ReportSeconds& seconds, std::int64_t peak_rss_bytes, int threads,
                           const PreviewFigures& previews = {}, const PlanHashes& hashes = {});

// Which of two plans of the same inputs is the better one.
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
// A whole plan is as good as its inputs make it, so one that was stopped is worse. Else fewer pieces without wood
// count first, then the cost that was being lowered: of choosing together while that is not done, then cost_total.
bool is_worse(const PlanFigures& plan, const PlanFigures& than);

struct ReportedPlan {
  PlanHashes hashes;
  PlanFigures figures;
};
// Of a report.json; none where there is no such file, or it does not tell them.
std::optional<ReportedPlan> read_report(const std::filesystem::path& path);
// Whether this file is the plan.json that it tells of. A run that was broken off may leave another one beside it.
bool is_of(const ReportedPlan& report, const std::filesystem::path& plan);
// Whether the plan of `there` stays where a new one of `inputs` would lie: one that was stopped takes no better one's
// place, if that is of the same inputs.
bool stays(const ReportedPlan& there, const PlanFigures& made, const std::string& inputs);

}  // namespace veneer::planner
