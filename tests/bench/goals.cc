#include "tests/bench/goals.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace veneer::bench {

Goals& Goals::all() {
  static Goals goals;
  return goals;
}

bool Goals::add(std::vector<Goal> goals) {
  goals_.insert(goals_.end(), std::make_move_iterator(goals.begin()), std::make_move_iterator(goals.end()));
  return true;
}

bool Judge::ReportContext(const Context& context) {
  shown_.SetOutputStream(&GetOutputStream());
  shown_.SetErrorStream(&GetErrorStream());
  return shown_.ReportContext(context);
}

void Judge::ReportRuns(const std::vector<Run>& runs) {
  shown_.ReportRuns(runs);
  for (const Run& run : runs) {
    if (run.run_type != Run::RT_Iteration) continue;
    const std::string name = run.run_name.function_name + (run.run_name.args.empty() ? "" : "/" + run.run_name.args);
    for (const Goal& goal : goals_)
      if (goal.benchmark == name) judge(run, goal);
  }
}

void Judge::expect_all(std::string_view beginning) {
  for (const Goal& goal : goals_)
    if (goal.benchmark.starts_with(beginning) && !judged_.contains(&goal)) miss(goal);
}

void Judge::miss(const Goal& goal) {
  ++missed_;
  told_ += fmt::format("{:<36} {:<14} not measured, wanted {} {}: MISSED\n", goal.benchmark, goal.figure, goal.most,
                       goal.unit);
}

void Judge::judge(const Run& run, const Goal& goal) {
  const auto counter = run.counters.find(goal.figure);
  const bool is_time = goal.figure == "time";
  judged_.insert(&goal);
  if (run.error_occurred || (!is_time && counter == run.counters.end())) return miss(goal);
  const double measured = is_time ? run.GetAdjustedRealTime() : static_cast<double>(counter->second);
  const bool kept = measured <= goal.most;  // not a number is not kept
  if (!kept) ++missed_;
  told_ += fmt::format("{:<36} {:<14} {:10.1f} {:<5} wanted {:g}: {}\n", goal.benchmark, goal.figure, measured,
                       goal.unit, goal.most, kept ? "kept" : "MISSED");
}

}  // namespace veneer::bench
