#include "daemon/plans/redo_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace veneer::daemon {
namespace {

Error is_good(const std::string& mark, JobId job) {
  return {ErrorCode::kConflict,
          fmt::format("piece {0} of job {1} is cut, and would be given up for another one: if it is lost, say so with "
                      "veneerctl job redo {1} {0} --lost",
                      mark, job.value)};
}

}  // namespace

Status none_is_good(const std::vector<db::PieceRecord>& pieces, JobId job, const std::vector<std::string>& marks) {
  for (const db::PieceRecord& piece : pieces)
    if (piece.state == db::PieceState::kCut && std::ranges::find(marks, piece.mark) != marks.end())
      return is_good(piece.mark, job);
  return Ok();
}

Result<std::vector<std::string>> marks_to_redo(const std::vector<db::PieceRecord>& pieces, JobId job,
                                               const std::vector<std::string>& named, bool lost) {
  const std::set<std::string> wanted(named.begin(), named.end());
  std::set<std::string> unknown = wanted;
  std::vector<std::string> out;
  for (const db::PieceRecord& piece : pieces) {
    unknown.erase(piece.mark);
    const bool missing = piece.state == db::PieceState::kScrap || piece.state == db::PieceState::kReleased ||
                         piece.state == db::PieceState::kUnfilled;
    if (wanted.empty() ? !missing : !wanted.contains(piece.mark)) continue;
    if (piece.state == db::PieceState::kSuspect)
      return Error{ErrorCode::kConflict,
                   fmt::format("piece {} of job {} is suspect: say first what became of it with veneerctl job settle",
                               piece.mark, job.value)};
    if (!missing && piece.state != db::PieceState::kCut)
      return Error{ErrorCode::kConflict,
                   fmt::format("piece {} of job {} has its wood and is still to be cut: veneerctl job start {}",
                               piece.mark, job.value, job.value)};
    if (!missing && !lost) return is_good(piece.mark, job);
    out.push_back(piece.mark);
  }
  if (!unknown.empty())
    return Error{ErrorCode::kNotFound, fmt::format("job {} has no piece {}: see veneerctl job pieces {}", job.value,
                                                   *unknown.begin(), job.value)};
  if (out.empty())
    return Error{
        ErrorCode::kInvalidArgument,
        fmt::format("no piece of job {0} is missing: name those that were lost after they were cut, with veneerctl job "
                    "redo {0} PIECE --lost",
                    job.value)};
  return out;
}

}  // namespace veneer::daemon
