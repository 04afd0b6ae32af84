#include "daemon/unit/job_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace veneer::daemon {
namespace {

std::string is_or_are(int count, const char* what) {
  return count == 1 ? fmt::format("1 is {}", what) : fmt::format("{} are {}", count, what);
}

// "a", "a and b", "a, b and c".
std::string listed(const std::vector<std::string>& parts, const char* last) {
  std::string out;
  for (std::size_t i = 0; i < parts.size(); ++i) out += (i == 0 ? "" : i + 1 == parts.size() ? last : ", ") + parts[i];
  return out;
}

std::string what_there_is(const JobRest& rest) {
  std::vector<std::string> parts = {fmt::format("{} of {} pieces of job {} {} cut", rest.cut, rest.pieces,
                                                rest.id.value, rest.cut == 1 ? "is" : "are")};
  if (rest.suspect > 0) parts.push_back(is_or_are(rest.suspect, "suspect"));
  if (rest.open > 0) parts.push_back(is_or_are(rest.open, "still to be cut"));
  if (rest.missing > 0) parts.push_back(is_or_are(rest.missing, "missing"));
  return listed(parts, " and ");
}

std::string scan_words(const std::vector<PanelId>& to_scan) {
  constexpr std::size_t kNamed = 3;
  if (to_scan.size() == 1)
    return fmt::format("panel {} waits for a scan: lay it on the scanner (veneerctl panel scan)", to_scan[0].value);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(kNamed, to_scan.size()); ++i) names.push_back(to_scan[i].value);
  if (to_scan.size() > kNamed) names.push_back(fmt::format("{} more", to_scan.size() - kNamed));
  return fmt::format("panels {} wait for a scan: lay each on the scanner (veneerctl panel scan)",
                     listed(names, " and "));
}

// What leads the cell back to where a job can be started.
void add_ways_to_idle(CellState state, std::vector<std::string>& steps) {
  switch (state) {
    case CellState::kAborted:
    case CellState::kAborting:
      steps.insert(steps.end(), {"Clear", "Reset"});
      return;
    case CellState::kStopped:
    case CellState::kComplete:
    case CellState::kClearing:
      steps.emplace_back("Reset");
      return;
    default:
      return;
  }
}

}  // namespace

JobRest rest_of(const db::JobRecord& job) {
  JobRest rest{job.id, job.name};
  for (const auto& [state, count] : job.pieces)
    if (state != db::PieceState::kUnfilled) rest.pieces += count;
  rest.cut = job.count(db::PieceState::kCut);
  rest.suspect = job.count(db::PieceState::kSuspect);
  rest.open = job.count(db::PieceState::kReserved) + job.count(db::PieceState::kCutting);
  rest.missing = job.state == db::JobState::kCancelled ? 0 : job.missing();  // it was given up
  return rest;
}

std::string pieces_words(std::size_t count) { return count == 1 ? "1 piece" : fmt::format("{} pieces", count); }

bool is_under_way(const CellView& view, JobId job) {
  if (!view.job || view.job->id != job) return false;
  switch (view.state) {
    case CellState::kStopped:
    case CellState::kAborted:
    case CellState::kClearing:
    case CellState::kResetting:
    case CellState::kIdle:
    case CellState::kComplete:
      return false;
    default:
      return true;
  }
}

std::string now_words(const CellView& view, JobId job) {
  if (!is_under_way(view, job)) return "";
  if (view.recutting)
    return view.recut_job == job ? "is cutting pieces again that were not through"
                                 : fmt::format("waits while pieces of job {} are cut again", view.recut_job.value);
  switch (view.state) {
    case CellState::kStarting:
      return "is being prepared";
    case CellState::kSuspending:
      return "waits for its next panel";
    case CellState::kSuspended:
      if (view.framing) return "has its frame traced";
      if (!view.load) return "waits for a panel";
      return view.load->found
                 ? fmt::format("waits for an operator's Unsuspend, with panel {} found", view.load->panel.value)
                 : fmt::format("waits for panel {}", view.load->panel.value);
    case CellState::kUnsuspending:
    case CellState::kUnholding:
      return "has its panel looked at";
    case CellState::kHolding:
    case CellState::kHeld:
      return "is held";
    case CellState::kStopping:
      return "is being stopped after the piece under way";
    case CellState::kCompleting:
      return "is being ended";
    case CellState::kAborting:
      return "is being broken off";
    default:
      return view.job->current_piece.empty() ? "is being cut" : "is cutting piece " + view.job->current_piece;
  }
}

std::string next_words(const CellView& view, const JobRest& rest, bool begun) {
  if (is_under_way(view, rest.id)) return "";
  if (!begun && rest.suspect == 0 && rest.missing == 0) return "";
  std::vector<std::string> steps;
  if (rest.open > 0) add_ways_to_idle(view.state, steps);
  if (rest.suspect > 0)
    steps.push_back(fmt::format("look at the suspect {0} and say what became of {1} (veneerctl job settle {2})",
                                rest.suspect == 1 ? "piece" : "pieces", rest.suspect == 1 ? "it" : "each",
                                rest.id.value));
  if (rest.missing > 0)
    steps.push_back(fmt::format("find other wood for what is missing (veneerctl job redo {})", rest.id.value));
  if (rest.open > 0) steps.push_back(fmt::format("Start cuts the rest (veneerctl job start {})", rest.id.value));
  if (steps.empty()) return "";
  return what_there_is(rest) + ": " + listed(steps, ", then ");
}

std::string next_words(const CellView& view, const std::vector<PanelId>& to_scan) {
  std::string job = view.rest ? next_words(view, *view.rest, true) : "";
  if (to_scan.empty()) return job;
  return scan_words(to_scan) + (job.empty() ? "" : ". " + job);
}

std::string nothing_to_cut(const db::JobRecord& job) {
  if (const int suspects = job.count(db::PieceState::kSuspect); suspects > 0)
    return fmt::format(
        "job {0} has no piece left to cut, but {1}: look at {2}, and say what you saw with veneerctl job "
        "settle {0}",
        job.id.value, suspects == 1 ? "1 is suspect" : fmt::format("{} are suspect", suspects),
        suspects == 1 ? "it" : "them");
  if (const int missing = job.missing(); missing > 0)
    return fmt::format("job {0} has no piece left to cut, and {1} missing: find other wood with veneerctl job redo {0}",
                       job.id.value, missing == 1 ? "1 is" : fmt::format("{} are", missing));
  return fmt::format("job {} has no piece left to cut", job.id.value);
}

std::string recovery_words(const db::Recovery& recovery) {
  const std::size_t suspect = recovery.suspects.size();
  const std::string pieces = suspect == 0   ? "no piece is suspect"
                             : suspect == 1 ? "one piece is suspect"
                                            : fmt::format("{} pieces are suspect", suspect);
  if (recovery.aborted_jobs.empty() && recovery.suspects.empty())
    return fmt::format("{}, and nobody has cleared that since: look at the panel, then Clear and Reset",
                       recovery.clear_owed.value_or("the work was broken off"));
  std::vector<std::string> jobs;
  for (const JobId job : recovery.aborted_jobs) jobs.push_back(std::to_string(job.value));
  const std::string doing =
      recovery.doing ? *recovery.doing
      : jobs.empty() ? "while it cut"
                     : fmt::format("in the middle of job{} {}", jobs.size() == 1 ? "" : "s", listed(jobs, " and "));
  return fmt::format("the cell stopped {}, and {}; look at the panel, then Clear and Reset", doing, pieces);
}

}  // namespace veneer::daemon
