// What became of suspect pieces: what scans saw of them, and what a person says.
#include <fmt/format.h>

#include <algorithm>

#include "db/audit_chain.h"
#include "db/job_sql.h"
#include "db/job_store.h"
#include "db/ledger_sql.h"
#include "db/panel_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

struct SuspectPiece {
  PieceId piece;
  std::string mark;
  std::string seen;  // by the scan that counts for its panel now; "" when that saw nothing of it
};
std::vector<SuspectPiece> suspects_of(SQLite::Database& connection, JobId job) {
  SQLite::Statement rows(
      connection, fmt::format("SELECT s.piece, s.mark, g.seen FROM piece_states AS s JOIN allocations AS w ON w.id = "
                              "s.allocation {} WHERE s.job = ? AND s.state = 'suspect' ORDER BY s.ordinal",
                              kSightingThatCounts));
  rows.bind(1, job.value);
  std::vector<SuspectPiece> out;
  while (rows.executeStep())
    out.push_back({{rows.getColumn(0).getInt64()},
                   text(rows.getColumn(1)),
                   rows.getColumn(2).isNull() ? "" : text(rows.getColumn(2))});
  return out;
}

std::vector<std::string> marks_seen(const std::vector<SuspectPiece>& suspects, const char* seen) {
  std::vector<std::string> out;
  for (const SuspectPiece& suspect : suspects)
    if (suspect.seen == seen) out.push_back(suspect.mark);
  return out;
}

// What a person said of pieces as he saw them listed holds only while a scan still says the same of each.
Status expect_seen(JobId job, const std::vector<SuspectPiece>& suspects, const std::vector<std::string>& marks,
                   const char* seen) {
  const auto now = marks_seen(suspects, seen);
  for (const std::string& mark : marks)
    if (std::find(now.begin(), now.end(), mark) == now.end())
      return Error{
          ErrorCode::kConflict,
          fmt::format("piece {} of job {} is not suspect any more, or the scan that counts now did not see its "
                      "wood {}: nothing was settled, look at the list again (veneerctl job settle {})",
                      mark, job.value, seen == std::string(to_string(Seen::kCut)) ? "gone" : "in the panel",
                      job.value)};
  return Ok();
}

// Why nothing can be taken over, and what helps.
Error nothing_seen(JobId job, const std::vector<SuspectPiece>& suspects) {
  if (suspects.empty()) return {ErrorCode::kConflict, fmt::format("job {} has no suspect piece", job.value)};
  const auto there = marks_seen(suspects, to_string(Seen::kStillThere));
  if (there.empty())
    return {
        ErrorCode::kConflict,
        fmt::format("no scan that counts saw what became of the suspect pieces of job {0}: scan their panels, or look "
                    "at each piece and say it with veneerctl job settle {0} PIECE VERDICT",
                    job.value)};
  const bool one = there.size() == 1;
  return {
      ErrorCode::kConflict,
      fmt::format("the scan saw the wood of {0} still in the panel, and no scan sees a cut that was only begun: look "
                  "at {1}, then say veneerctl job settle {2} --as-seen --there scrap --pieces {3} (or released for "
                  "scrap, when {4} burnt)",
                  fmt::join(there, ", "), one ? "it" : "each", job.value, fmt::join(there, " "),
                  one ? "it is not" : "none is")};
}

// It was called scrap by mistake, and somebody has to look again.
Status take_back(SQLite::Database& connection, const PieceRecord& piece, const std::string& who,
                 const std::string& at) {
  if (piece.state != PieceState::kScrap)
    return Error{ErrorCode::kConflict,
                 fmt::format("piece {} of job {} is {}, and only that a piece is lost is taken back", piece.mark,
                             piece.job.value, to_string(piece.state))};
  if (piece.panel && is_retired(connection, *piece.panel)) return retired_meanwhile(*piece.panel);
  move_piece(connection, piece.id, AllocationState::kScrap, AllocationState::kSuspect, at);
  note_verdict(connection, piece.id, {AllocationState::kSuspect, false, who, at});
  const auto state = state_of(connection, piece.job);
  if (!state.ok()) return state.error();
  return *state == JobState::kComplete ? move_job(connection, piece.job, JobState::kStopped, at, who) : Ok();
}

// A job that waited for the last of its suspect pieces is complete.
Status follow_settled(SQLite::Database& connection, JobId job, const std::string& at, const std::string& who) {
  const auto state = state_of(connection, job);
  if (!state.ok()) return state.error();
  const bool waits = *state == JobState::kAborted || *state == JobState::kStopped;
  if (waits && open_pieces(connection, job) == 0) return move_job(connection, job, JobState::kComplete, at, who);
  return Ok();
}

}  // namespace

void note_verdict(SQLite::Database& connection, PieceId piece, const SaidOfPiece& said) {
  SQLite::Statement insert(connection,
                           "INSERT INTO verdicts (allocation, step, verdict, as_seen, who, at) SELECT s.allocation, "
                           "(SELECT max(id) FROM allocation_history WHERE allocation = s.allocation), ?, ?, ?, ? FROM "
                           "piece_states AS s WHERE s.piece = ?");
  SQLite::bind(insert, to_string(said.verdict), said.as_seen ? 1 : 0, said.who, said.at, piece.value);
  insert.exec();
}

Status JobStore::note_sightings(std::span<const std::pair<AllocationId, Sighting>> seen) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement insert(
        connection,
        "INSERT INTO sightings (allocation, step, seen, gone, mask_version, at) SELECT a.id, (SELECT max(id) FROM "
        "allocation_history WHERE allocation = a.id), ?2, ?3, ?4, ?5 FROM allocations AS a WHERE a.id = ?1 AND a.state "
        "= 'suspect'");
    for (const auto& [allocation, sighting] : seen) {
      insert.reset();
      SQLite::bind(insert, allocation.value, to_string(sighting.seen), sighting.gone, sighting.mask_version,
                   sighting.at);
      insert.exec();
    }
    return Ok();
  });
}

Status JobStore::settle(PieceId piece, AllocationState verdict, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto found = read_piece(connection, piece);
    if (!found.ok()) return found.error();
    if (verdict == AllocationState::kSuspect) return take_back(connection, *found, who, at);
    const bool known =
        verdict == AllocationState::kCut || verdict == AllocationState::kScrap || verdict == AllocationState::kReleased;
    if (!known || !move_piece(connection, piece, AllocationState::kSuspect, verdict, at))
      return piece_is_elsewhere(connection, piece, verdict);
    note_verdict(connection, piece, {verdict, false, who, at});
    return follow_settled(connection, found->job, at, who);
  });
}

Result<SettledAsSeen> JobStore::settle_as_seen(JobId job, const AsSeen& said, const std::string& who,
                                               const std::string& at) {
  if (said.there && *said.there != AllocationState::kScrap && *said.there != AllocationState::kReleased)
    return Error{ErrorCode::kInvalidArgument, "a piece whose wood is in the panel is scrap or released"};
  if (said.pieces ? said.pieces->empty() : said.there.has_value())
    return Error{ErrorCode::kInvalidArgument,
                 "name the pieces that you looked at: what is said of wood in the panel holds for no other"};
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<SettledAsSeen> {
    if (const auto state = state_of(connection, job); !state.ok()) return state.error();
    const char* const wanted = to_string(said.there ? Seen::kStillThere : Seen::kCut);
    const auto suspects = suspects_of(connection, job);
    if (said.pieces)
      if (Status same = expect_seen(job, suspects, *said.pieces, wanted); !same.ok()) return same.error();
    SettledAsSeen out;
    for (const SuspectPiece& suspect : suspects) {
      const bool settled =
          suspect.seen == wanted &&
          (!said.pieces || std::find(said.pieces->begin(), said.pieces->end(), suspect.mark) != said.pieces->end());
      (!settled ? out.left : said.there ? out.there : out.cut).push_back(suspect.mark);
      if (!settled) continue;
      const AllocationState verdict = said.there.value_or(AllocationState::kCut);
      move_piece(connection, suspect.piece, AllocationState::kSuspect, verdict, at);
      note_verdict(connection, suspect.piece, {verdict, true, who, at});
    }
    if (out.cut.empty() && out.there.empty()) return nothing_seen(job, suspects);
    append_to_chain(connection, {0, at, who, "job.settle-as-seen",
                                 fmt::format("job {}; cut: {}; {}: {}; still suspect: {}", job.value,
                                             fmt::join(out.cut, ", "), said.there ? to_string(*said.there) : "there",
                                             fmt::join(out.there, ", "), fmt::join(out.left, ", "))});
    if (Status followed = follow_settled(connection, job, at, who); !followed.ok()) return followed.error();
    return out;
  });
}

}  // namespace veneer::db
