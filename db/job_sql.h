// Steps that job_store.cc shares with job_reader.cc, queue.cc, settling.cc, proofs.cc and aborts.cc. Private to db;
// these throw SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <optional>
#include <string>
#include <vector>

#include "db/job_store.h"

namespace veneer::db {

inline Error no_such_job(JobId job) {
  return {ErrorCode::kNotFound, fmt::format("there is no job {}: see `veneerctl job list`", job.value)};
}

inline Error no_such_piece(JobId job, const std::string& mark) {
  return {ErrorCode::kNotFound,
          fmt::format("job {0} has no piece {1}: see `veneerctl job pieces {0}`", job.value, mark)};
}

// The sighting g, if any, that tells of the suspect piece whose row of piece_states is s and whose wood is the
// allocation w: noted since it became suspect, by the scan whose map counts. A scan that was taken back, or that a
// later one followed which noted nothing, saw another map than the newest.
inline constexpr const char* kSightingThatCounts =
    "LEFT JOIN sightings AS g ON g.id = CASE s.state WHEN 'suspect' THEN (SELECT max(id) FROM sightings WHERE "
    "allocation = s.allocation AND step = (SELECT max(id) FROM allocation_history WHERE allocation = s.allocation)) "
    "END AND (SELECT map_file FROM masks WHERE panel = w.panel AND version = g.mask_version) = (SELECT map_file FROM "
    "masks WHERE panel = w.panel ORDER BY version DESC LIMIT 1) ";

JobState job_state_of(const std::string& name);
Result<JobState> state_of(SQLite::Database& connection, JobId job);
// Refuses with a sentence before the schema's trigger would. `who` did it; "": the cell by itself.
Status move_job(SQLite::Database& connection, JobId job, JobState to, const std::string& at,
                const std::string& who = {});
int open_pieces(SQLite::Database& connection, JobId job);  // reserved, being cut or suspect
// kConflict, or kNotFound: it is in another state than the one from which it becomes `to`.
Status piece_is_elsewhere(SQLite::Database& connection, PieceId piece, AllocationState to);
Result<PieceRecord> read_piece(SQLite::Database& connection, PieceId piece);
std::vector<JobWork> jobs_with_work(SQLite::Database& connection);  // as JobStore::with_work()
// What a person said of a piece.
struct SaidOfPiece {
  AllocationState verdict;
  bool as_seen;  // by a scan
  const std::string& who;
  const std::string& at;
};
// In the transaction that moved its wood to that state.
void note_verdict(SQLite::Database& connection, PieceId piece, const SaidOfPiece& said);
// The panel of the run was seen where it has to lie: all that the run has booked is proven, and the audit log says so.
void note_proven(SQLite::Database& connection, RunId run, const std::string& at);
// The cell is Aborted until somebody clears that, and nothing is under way. `who` gave the STOP; "": the program did
// it.
void note_broken_off(SQLite::Database& connection, const std::string& reason, const std::string& at,
                     const std::string& who = {});
std::optional<std::string> clear_owed(SQLite::Database& connection);
// What the cell is doing; nothing at rest.
std::optional<std::string> under_way(SQLite::Database& connection);
void note_rest(SQLite::Database& connection, const std::string& at);
void note_activity(SQLite::Database& connection, bool under_way, const std::string& doing, const std::string& at);

}  // namespace veneer::db
