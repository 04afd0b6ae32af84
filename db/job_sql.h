// Steps that job_store.cc shares with job_reader.cc, proofs.cc and aborts.cc. Private to db; these throw
// SQLite::Exception.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <optional>
#include <string>

#include "db/job_store.h"

namespace veneer::db {

inline Error no_such_job(JobId job) {
  return {ErrorCode::kNotFound, fmt::format("there is no job {}: see `veneerctl job list`", job.value)};
}

inline Error no_such_piece(JobId job, const std::string& mark) {
  return {ErrorCode::kNotFound,
          fmt::format("job {0} has no piece {1}: see `veneerctl job pieces {0}`", job.value, mark)};
}

JobState job_state_of(const std::string& name);
Result<PieceRecord> read_piece(SQLite::Database& connection, PieceId piece);
// The panel of the run was seen where it has to lie: all that the run has booked is proven, and the audit log says so.
void note_proven(SQLite::Database& connection, RunId run, const std::string& at);
// The cell is Aborted until somebody clears that.
void note_broken_off(SQLite::Database& connection, const std::string& reason, const std::string& at);
std::optional<std::string> clear_owed(SQLite::Database& connection);

}  // namespace veneer::db
