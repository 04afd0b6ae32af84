#include "db/job_store.h"

#include <fmt/format.h>

#include "db/job_sql.h"
#include "db/ledger_sql.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

Error no_such_job(JobId job) {
  return {ErrorCode::kNotFound, fmt::format("there is no job {}: see `veneerctl job list`", job.value)};
}

Result<JobState> state_of(SQLite::Database& connection, JobId job) {
  SQLite::Statement row(connection, "SELECT state FROM jobs WHERE id = ?");
  row.bind(1, job.value);
  if (!row.executeStep()) return no_such_job(job);
  return job_state_of(text(row.getColumn(0)));
}

// Refuses with a sentence before the schema's trigger would.
Status move_job(SQLite::Database& connection, JobId job, JobState to, const std::string& at) {
  const auto from = state_of(connection, job);
  if (!from.ok()) return from.error();
  SQLite::Statement allowed(connection, "SELECT 1 FROM job_moves WHERE from_state = ? AND to_state = ?");
  SQLite::bind(allowed, to_string(*from), to_string(to));
  if (!allowed.executeStep())
    return Error{ErrorCode::kConflict,
                 fmt::format("job {} is {}: it cannot become {}", job.value, to_string(*from), to_string(to))};
  SQLite::Statement update(connection, "UPDATE jobs SET state = ?, changed_at = ? WHERE id = ?");
  SQLite::bind(update, to_string(to), at, job.value);
  update.exec();
  return Ok();
}

int open_pieces(SQLite::Database& connection, JobId job) {
  SQLite::Statement row(
      connection, "SELECT count(*) FROM piece_states WHERE job = ? AND state IN ('reserved','cutting','suspect')");
  row.bind(1, job.value);
  row.executeStep();
  return row.getColumn(0).getInt();
}

// Complete when no piece is left to cut or to settle, `otherwise` else.
JobState state_after(SQLite::Database& connection, JobId job, JobState otherwise) {
  return open_pieces(connection, job) == 0 ? JobState::kComplete : otherwise;
}

// The run that is on in the cell: its id and job; zeros when none is.
struct OpenRun {
  RunId run;
  JobId job;
};
OpenRun open_run(SQLite::Database& connection) {
  SQLite::Statement row(connection, "SELECT id, job FROM runs WHERE ended_at IS NULL");
  if (!row.executeStep()) return {};
  return {{row.getColumn(0).getInt64()}, {row.getColumn(1).getInt64()}};
}

Status expect_no_run_of(SQLite::Database& connection, JobId job) {
  const OpenRun on = open_run(connection);
  if (on.run.value == 0 || on.job != job) return Ok();
  return Error{ErrorCode::kConflict, fmt::format("run {} of job {} is on: end it first", on.run.value, job.value)};
}

// The job of an open run; kConflict when it has ended.
Result<JobId> job_of_open_run(SQLite::Database& connection, RunId run) {
  const OpenRun on = open_run(connection);
  if (on.run == run && run.value != 0) return on.job;
  return Error{ErrorCode::kConflict, fmt::format("run {} is not on", run.value)};
}

void end_run(SQLite::Database& connection, RunId run, const std::string& result, const std::string& at) {
  SQLite::Statement update(connection, "UPDATE runs SET ended_at = ?, result = ? WHERE id = ?");
  SQLite::bind(update, at, result, run.value);
  update.exec();
}

Status piece_is_elsewhere(SQLite::Database& connection, PieceId piece, AllocationState to) {
  SQLite::Statement row(connection,
                        "SELECT s.state, p.mark, p.job FROM piece_states AS s JOIN pieces AS p ON p.id = s.piece "
                        "WHERE p.id = ?");
  row.bind(1, piece.value);
  if (!row.executeStep()) return Error{ErrorCode::kNotFound, fmt::format("there is no piece {}", piece.value)};
  return Error{ErrorCode::kConflict,
               fmt::format("piece {} of job {} is {}: it cannot become {}", text(row.getColumn(1)),
                           row.getColumn(2).getInt64(), text(row.getColumn(0)), to_string(to))};
}

Status move_one(Database& database, PieceId piece, AllocationState from, AllocationState to, const std::string& at) {
  return in_transaction(database, [&](SQLite::Database& connection) -> Status {
    if (move_piece(connection, piece, from, to, at)) return Ok();
    return piece_is_elsewhere(connection, piece, to);
  });
}

Result<std::vector<NewAllocation>> insert_pieces(SQLite::Database& connection, JobId job,
                                                 const std::vector<NewPiece>& pieces) {
  SQLite::Statement insert(connection,
                           "INSERT INTO pieces (job, ordinal, mark, artwork_outline_um, panel, panel_outline_um, "
                           "angle_rad, shift_x_mm, shift_y_mm, improper, lead_in_um) "
                           "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  std::vector<NewAllocation> wood;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const NewPiece& piece = pieces[i];
    if (piece.panel && piece.panel_outline.size() != piece.artwork_outline.size())
      return Error{ErrorCode::kInvalidArgument,
                   fmt::format("the two outlines of piece {} have different vertices", piece.mark)};
    insert.reset();
    SQLite::bind(insert, job.value, static_cast<std::int64_t>(i), piece.mark,
                 write_ring(to_micro(piece.artwork_outline)));
    piece.panel ? insert.bind(5, piece.panel->value) : insert.bind(5);
    insert.bind(6, write_ring(to_micro(piece.panel_outline)));
    bind_isometry(insert, 7, piece.panel_from_artwork);
    std::vector<Point<PanelFrame>> lead_in;
    if (piece.lead_in) lead_in.push_back(*piece.lead_in);
    insert.bind(11, write_ring(to_micro(lead_in)));
    insert.exec();
    if (piece.panel)
      wood.push_back(
          {*piece.panel, job, PieceId{connection.getLastInsertRowid()}, piece.panel_outline, piece.allocation});
  }
  return wood;
}

}  // namespace

Result<JobId> JobStore::create(const NewJob& job, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<JobId> {
    SQLite::Statement insert(connection,
                             "INSERT INTO jobs (name, state, created_at, changed_at, target_file, preview_file, "
                             "options_json, plan_json) VALUES (?, 'planned', ?, ?, ?, ?, ?, ?)");
    SQLite::bind(insert, job.name, at, at, job.target_file, job.preview_file, job.options_json, job.plan_json);
    insert.exec();
    const JobId id{connection.getLastInsertRowid()};
    const auto wood = insert_pieces(connection, id, job.pieces);
    if (!wood.ok()) return wood.error();
    if (Status reserved = insert_reserved(connection, *wood, at); !reserved.ok()) return reserved.error();
    return id;
  });
}

Status JobStore::cancel(JobId job, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status idle = expect_no_run_of(connection, job); !idle.ok()) return idle;
    if (Status moved = move_job(connection, job, JobState::kCancelled, at); !moved.ok()) return moved;
    move_all(connection, job, AllocationState::kReserved, AllocationState::kReleased, at);
    return Ok();
  });
}

Result<RunId> JobStore::start_run(JobId job, const PanelId& panel,
                                  const Isometry2<BedFrame, PanelFrame>& bed_from_panel, Millimetres pose_rms,
                                  const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<RunId> {
    const OpenRun on = open_run(connection);
    if (on.run.value != 0)
      return Error{ErrorCode::kConflict,
                   fmt::format("run {} of job {} is on: end it first", on.run.value, on.job.value)};
    const auto state = state_of(connection, job);
    if (!state.ok()) return state.error();
    if (*state != JobState::kRunning)
      if (Status moved = move_job(connection, job, JobState::kRunning, at); !moved.ok()) return moved.error();
    SQLite::Statement left(connection,
                           "SELECT 1 FROM allocations WHERE job = ? AND panel = ? AND state = 'reserved' LIMIT 1");
    SQLite::bind(left, job.value, panel.value);
    if (!left.executeStep())
      return Error{ErrorCode::kConflict,
                   fmt::format("job {} has nothing left to cut on panel {}", job.value, panel.value)};
    SQLite::Statement insert(connection,
                             "INSERT INTO runs (job, panel, angle_rad, shift_x_mm, shift_y_mm, improper, pose_rms_mm, "
                             "started_at, result) VALUES (?, ?, ?, ?, ?, ?, ?, ?, '')");
    SQLite::bind(insert, job.value, panel.value);
    bind_isometry(insert, 3, bed_from_panel);
    insert.bind(7, pose_rms.count());
    insert.bind(8, at);
    insert.exec();
    return RunId{connection.getLastInsertRowid()};
  });
}

Status JobStore::mark_cutting(PieceId piece, const std::string& at) {
  return move_one(*database_, piece, AllocationState::kReserved, AllocationState::kCutting, at);
}

Status JobStore::book_piece(PieceId piece, const std::string& at) {
  return move_one(*database_, piece, AllocationState::kCutting, AllocationState::kCut, at);
}

Status JobStore::finish_run(RunId run, bool more, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto job = job_of_open_run(connection, run);
    if (!job.ok()) return job.error();
    SQLite::Statement left(connection, "SELECT 1 FROM allocations WHERE job = ? AND state = 'reserved' LIMIT 1");
    left.bind(1, job->value);
    const bool goes_on = more && left.executeStep();
    const JobState next = state_after(connection, *job, goes_on ? JobState::kRunning : JobState::kStopped);
    end_run(connection, run, next == JobState::kStopped ? "stopped" : "done", at);
    return next == JobState::kRunning ? Ok() : move_job(connection, *job, next, at);
  });
}

Status JobStore::abort_run(RunId run, std::span<const PieceId> suspects, const std::string& reason,
                           const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto job = job_of_open_run(connection, run);
    if (!job.ok()) return job.error();
    for (const PieceId suspect : suspects) {
      const auto piece = read_piece(connection, suspect);
      if (!piece.ok()) return piece.error();
      if (piece->job != *job)
        return Error{ErrorCode::kInvalidArgument, fmt::format("piece {} is not of job {}", piece->mark, job->value)};
      move_piece(connection, suspect, AllocationState::kReserved, AllocationState::kCutting, at);
    }
    move_all(connection, *job, AllocationState::kCutting, AllocationState::kSuspect, at);
    end_run(connection, run, reason, at);
    return move_job(connection, *job, state_after(connection, *job, JobState::kAborted), at);
  });
}

Status JobStore::abort_job(JobId job, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status idle = expect_no_run_of(connection, job); !idle.ok()) return idle;
    return move_job(connection, job, state_after(connection, job, JobState::kAborted), at);
  });
}

Status JobStore::stop_job(JobId job, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status idle = expect_no_run_of(connection, job); !idle.ok()) return idle;
    return move_job(connection, job, state_after(connection, job, JobState::kStopped), at);
  });
}

Status JobStore::settle(PieceId piece, AllocationState verdict, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto found = read_piece(connection, piece);
    if (!found.ok()) return found.error();
    const bool known =
        verdict == AllocationState::kCut || verdict == AllocationState::kScrap || verdict == AllocationState::kReleased;
    if (!known || !move_piece(connection, piece, AllocationState::kSuspect, verdict, at))
      return piece_is_elsewhere(connection, piece, verdict);
    const auto state = state_of(connection, found->job);
    if (!state.ok()) return state.error();
    const bool waits = *state == JobState::kAborted || *state == JobState::kStopped;
    if (waits && open_pieces(connection, found->job) == 0)
      return move_job(connection, found->job, JobState::kComplete, at);
    return Ok();
  });
}

Result<Recovery> JobStore::recover(const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<Recovery> {
    Recovery found;
    SQLite::Statement cutting(connection, "SELECT piece FROM allocations WHERE state = 'cutting' ORDER BY id");
    while (cutting.executeStep()) found.suspects.push_back({cutting.getColumn(0).getInt64()});
    SQLite::Statement running(connection, "SELECT id FROM jobs WHERE state = 'running' ORDER BY id");
    std::vector<JobId> jobs;
    while (running.executeStep()) jobs.push_back({running.getColumn(0).getInt64()});
    for (const JobId job : jobs) {
      move_all(connection, job, AllocationState::kCutting, AllocationState::kSuspect, at);
      if (const OpenRun on = open_run(connection); on.run.value != 0 && on.job == job)
        end_run(connection, on.run, "the daemon ended in the middle of it", at);
      const JobState next = state_after(connection, job, JobState::kAborted);
      if (Status moved = move_job(connection, job, next, at); !moved.ok()) return moved.error();
      (next == JobState::kComplete ? found.completed_jobs : found.aborted_jobs).push_back(job);
    }
    return found;
  });
}

}  // namespace veneer::db
