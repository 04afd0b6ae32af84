#include "db/job_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "db/audit_chain.h"
#include "db/done_by_sql.h"
#include "db/job_sql.h"
#include "db/lease_sql.h"
#include "db/ledger_sql.h"
#include "db/panel_sql.h"
#include "db/plan_sql.h"
#include "db/request_sql.h"
#include "db/sql.h"

namespace veneer::db {

Result<JobState> state_of(SQLite::Database& connection, JobId job) {
  SQLite::Statement row(connection, "SELECT state FROM jobs WHERE id = ?");
  row.bind(1, job.value);
  if (!row.executeStep()) return no_such_job(job);
  return job_state_of(text(row.getColumn(0)));
}

Status move_job(SQLite::Database& connection, JobId job, JobState to, const std::string& at, const std::string& who) {
  const auto from = state_of(connection, job);
  if (!from.ok()) return from.error();
  SQLite::Statement allowed(connection, "SELECT 1 FROM job_moves WHERE from_state = ? AND to_state = ?");
  SQLite::bind(allowed, to_string(*from), to_string(to));
  if (!allowed.executeStep())
    return Error{ErrorCode::kConflict,
                 fmt::format("job {} is {} and cannot become {}", job.value, to_string(*from), to_string(to))};
  SQLite::Statement update(connection, "UPDATE jobs SET state = ?, changed_at = ? WHERE id = ?");
  SQLite::bind(update, to_string(to), at, job.value);
  update.exec();
  if (who.empty()) return Ok();
  SQLite::Statement step(connection, "SELECT max(id) FROM job_history WHERE job = ?");
  step.bind(1, job.value);
  step.executeStep();
  note_done_by(connection, Done::kJobMoved, step.getColumn(0).getInt64(), who);
  return Ok();
}

int open_pieces(SQLite::Database& connection, JobId job) {
  SQLite::Statement row(
      connection, "SELECT count(*) FROM piece_states WHERE job = ? AND state IN ('reserved','cutting','suspect')");
  row.bind(1, job.value);
  row.executeStep();
  return row.getColumn(0).getInt();
}

Status piece_is_elsewhere(SQLite::Database& connection, PieceId piece, AllocationState to) {
  SQLite::Statement row(connection, "SELECT state, mark, job FROM piece_states WHERE piece = ?");
  row.bind(1, piece.value);
  if (!row.executeStep())
    return Error{ErrorCode::kNotFound, fmt::format("there is no piece {}: see `veneerctl job pieces`", piece.value)};
  return Error{ErrorCode::kConflict,
               fmt::format("piece {} of job {} is {} and cannot become {}", text(row.getColumn(1)),
                           row.getColumn(2).getInt64(), text(row.getColumn(0)), to_string(to))};
}

namespace {

// Complete when no piece is left to cut or to settle, `otherwise` else.
JobState state_after(SQLite::Database& connection, JobId job, JobState otherwise) {
  return open_pieces(connection, job) == 0 ? JobState::kComplete : otherwise;
}

// It ends there, unless every piece was cut by then: that it is complete nobody's word made it.
Status break_off(SQLite::Database& connection, JobId job, JobState to, const std::string& at, const std::string& who) {
  const JobState next = state_after(connection, job, to);
  return move_job(connection, job, next, at, next == to ? who : "");
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

// Between two panels; a job that is over must not begin again because of it.
Status expect_waiting(SQLite::Database& connection, JobId job, JobState to) {
  if (Status idle = expect_no_run_of(connection, job); !idle.ok()) return idle;
  const auto state = state_of(connection, job);
  if (!state.ok()) return state.error();
  if (*state == JobState::kRunning) return Ok();
  return Error{ErrorCode::kConflict,
               fmt::format("job {} is {} and cannot become {}", job.value, to_string(*state), to_string(to))};
}

// The job of an open run; kConflict when it has ended.
Result<JobId> job_of_open_run(SQLite::Database& connection, RunId run) {
  const OpenRun on = open_run(connection);
  if (on.run == run && run.value != 0) return on.job;
  return Error{ErrorCode::kConflict, fmt::format("run {} is not on", run.value)};
}

void note_run(SQLite::Database& connection, const std::string& who, const std::string& what, RunId run, JobId job,
              const PanelId& panel, const std::string& more, const std::string& at) {
  append_to_chain(connection, {0, at, who, "run." + what,
                               fmt::format("run {} of job {} on {}{}", run.value, job.value, panel.value, more)});
}

void end_run(SQLite::Database& connection, RunId run, const std::string& result, const std::string& at) {
  SQLite::Statement update(connection, "UPDATE runs SET ended_at = ?, result = ? WHERE id = ?");
  SQLite::bind(update, at, result, run.value);
  update.exec();
  SQLite::Statement of(connection, "SELECT job, panel FROM runs WHERE id = ?");
  of.bind(1, run.value);
  if (of.executeStep())
    note_run(connection, kDaemon, "end", run, {of.getColumn(0).getInt64()}, {text(of.getColumn(1))}, ", " + result, at);
}

void note_facts(SQLite::Database& connection, RunId run, const RunFacts& facts) {
  SQLite::Statement insert(connection, "INSERT INTO run_facts (run, who, certificates, recipes) VALUES (?, ?, ?, ?)");
  std::vector<std::int64_t> certificates;
  for (const CertificateId certificate : facts.certificates) certificates.push_back(certificate.value);
  SQLite::bind(insert, run.value, facts.who, fmt::format("[{}]", fmt::join(certificates, ",")), facts.recipes_json);
  insert.exec();
}

Status move_one(Database& database, PieceId piece, AllocationState from, AllocationState to, const std::string& at) {
  return in_transaction(database, [&](SQLite::Database& connection) -> Status {
    if (move_piece(connection, piece, from, to, at)) return Ok();
    return piece_is_elsewhere(connection, piece, to);
  });
}

// One allocation for each placement of the job's plan; the first piece whose wood is taken is named (kConflict).
Status reserve(SQLite::Database& connection, JobId job, PlanId plan, const std::string& at) {
  end_expired(connection, at);
  SQLite::Statement placed(connection,
                           "SELECT p.id, t.mark, l.id, l.panel, l.area_um, veneer_outline(l.panel_outline_um), CASE "
                           "l.lead_in_um WHEN '[]' THEN '~' ELSE veneer_lead_in(l.area_um, l.panel_outline_um) END "
                           "FROM placements AS l JOIN patches AS t ON t.id = l.patch JOIN pieces AS p ON p.patch = "
                           "t.id AND p.job = ? WHERE l.plan = ? ORDER BY t.ordinal");
  SQLite::bind(placed, job.value, plan.value);
  SQLite::Statement insert(connection,
                           "INSERT INTO allocations (panel, job, piece, placement, state, area_um, outline_um, "
                           "lead_in_um, reason, changed_at) VALUES (?, ?, ?, ?, 'reserved', ?, ?, ?, '', ?)");
  while (placed.executeStep()) {
    const Wanted wanted{text(placed.getColumn(1)), {text(placed.getColumn(3))}, text(placed.getColumn(4)), plan};
    insert.reset();
    SQLite::bind(insert, wanted.panel.value, job.value, placed.getColumn(0).getInt64(), placed.getColumn(2).getInt64(),
                 wanted.area, text(placed.getColumn(5)), text(placed.getColumn(6)), at);
    if (Status booked = book(connection, insert, wanted); !booked.ok()) return booked;
  }
  return Ok();
}

Result<JobId> make_job(SQLite::Database& connection, PlanId plan, const std::string& at,
                       const std::optional<KeyedRequest>& request, const std::string& who) {
  if (Status whole = may_have_wood(connection, plan); !whole.ok()) return whole.error();
  SQLite::Statement insert(connection,
                           "INSERT INTO jobs (name, plan, state, created_at, changed_at) "
                           "SELECT name, id, 'planned', ?, ? FROM plans WHERE id = ?");
  SQLite::bind(insert, at, at, plan.value);
  if (insert.exec() == 0) return no_such_plan(plan);
  const JobId job{connection.getLastInsertRowid()};
  note_done_by(connection, Done::kJobMade, job.value, who);
  SQLite::Statement pieces(connection,
                           "INSERT INTO pieces (job, patch) SELECT ?, id FROM patches WHERE plan = ? ORDER BY ordinal");
  SQLite::bind(pieces, job.value, plan.value);
  pieces.exec();
  // What the plan leased is free for nobody else in between; it may even be past its time.
  end_lease(connection, plan, LeaseEnd::kTaken, at);
  if (Status reserved = reserve(connection, job, plan, at); !reserved.ok()) return reserved.error();
  if (request)
    if (Status noted = write_result(connection, *request, fmt::format("{{\"job\":{}}}", job.value)); !noted.ok())
      return noted.error();
  return job;
}

// A piece that is to be made again: one that has wood is lost from now on, if that wood is cut, and `who` said so.
Status give_up(SQLite::Database& connection, JobId job, const std::string& mark, const std::string& who,
               const std::string& at) {
  SQLite::Statement row(connection, "SELECT piece, state FROM piece_states WHERE job = ? AND mark = ?");
  SQLite::bind(row, job.value, mark);
  if (!row.executeStep()) return no_such_piece(job, mark);
  const PieceId piece{row.getColumn(0).getInt64()};
  const std::string state = text(row.getColumn(1));
  if (state == "scrap" || state == "released" || state == "unfilled") return Ok();
  if (move_piece(connection, piece, AllocationState::kCut, AllocationState::kScrap, at)) {
    note_verdict(connection, piece, {AllocationState::kScrap, false, who, at});
    return Ok();
  }
  const auto remedy =
      state == "suspect" ? fmt::format("say first what became of it with `veneerctl job settle {} {}`", job.value, mark)
                         : fmt::format("its wood is still to be cut, with `veneerctl job start {}`", job.value);
  return Error{ErrorCode::kConflict, fmt::format("piece {} of job {} is {}: {}", mark, job.value, state, remedy)};
}

bool is_archived(SQLite::Database& connection, JobId job) {
  SQLite::Statement row(connection, "SELECT archived FROM archivings WHERE job = ? ORDER BY id DESC LIMIT 1");
  row.bind(1, job.value);
  return row.executeStep() && row.getColumn(0).getInt() != 0;
}

void note_archived(SQLite::Database& connection, JobId job, bool archived, const std::string& at,
                   const std::string& who) {
  SQLite::Statement insert(connection, "INSERT INTO archivings (job, archived, at) VALUES (?, ?, ?)");
  SQLite::bind(insert, job.value, archived ? 1 : 0, at);
  insert.exec();
  note_done_by(connection, Done::kJobArchived, connection.getLastInsertRowid(), who);
}

// One piece; nothing where it is so already.
Status note_assembled(SQLite::Database& connection, JobId job, const std::string& mark, bool assembled,
                      const std::string& who, const std::string& at) {
  SQLite::Statement row(
      connection,
      "SELECT s.state, s.allocation, coalesce((SELECT assembled FROM assemblies WHERE allocation = "
      "s.allocation ORDER BY id DESC LIMIT 1), 0) FROM piece_states AS s WHERE s.job = ? AND s.mark = ?");
  SQLite::bind(row, job.value, mark);
  if (!row.executeStep()) return no_such_piece(job, mark);
  const std::string state = text(row.getColumn(0));
  if (state != "cut") {
    const bool lost = state == "scrap" || state == "released" || state == "unfilled";
    const auto remedy = state == "suspect"
                            ? fmt::format("say what became of it with `veneerctl job settle {} {}`", job.value, mark)
                        : state == "cutting" ? std::string("wait until it is cut")
                        : lost ? fmt::format("find other wood for it with `veneerctl job redo {} {}`", job.value, mark)
                               : fmt::format("cut it with `veneerctl job start {}`", job.value);
    return Error{ErrorCode::kConflict,
                 fmt::format("piece {} of job {} is {}, and only a piece that is cut is assembled: {}", mark, job.value,
                             state == "cutting" ? "being cut" : state, remedy)};
  }
  if ((row.getColumn(2).getInt() != 0) == assembled) return Ok();
  SQLite::Statement insert(connection, "INSERT INTO assemblies (allocation, assembled, who, at) VALUES (?, ?, ?, ?)");
  SQLite::bind(insert, row.getColumn(1).getInt64(), assembled ? 1 : 0, who, at);
  insert.exec();
  return Ok();
}

// What a beam may have hit by mistake, or missed. A job that was complete is stopped: it has pieces to settle.
Status doubt(SQLite::Database& connection, std::span<const PieceId> pieces, const std::string& at) {
  SQLite::Statement complete(connection,
                             "SELECT j.id FROM pieces AS p JOIN jobs AS j ON j.id = p.job WHERE p.id = ? AND j.state = "
                             "'complete'");
  for (const PieceId piece : pieces) {
    if (!move_piece(connection, piece, AllocationState::kReserved, AllocationState::kSuspect, at) &&
        !move_piece(connection, piece, AllocationState::kCut, AllocationState::kSuspect, at))
      continue;
    complete.reset();
    complete.bind(1, piece.value);
    if (!complete.executeStep()) continue;
    if (Status stopped = move_job(connection, {complete.getColumn(0).getInt64()}, JobState::kStopped, at); !stopped)
      return stopped;
  }
  return Ok();
}

// What a program that ended left behind, of which nothing was recovered yet: every running job counts as aborted.
Recovery found_at_work(SQLite::Database& connection) {
  Recovery found;
  found.doing = under_way(connection);
  SQLite::Statement cutting(connection, "SELECT piece FROM allocations WHERE state = 'cutting' ORDER BY id");
  while (cutting.executeStep()) found.suspects.push_back({cutting.getColumn(0).getInt64()});
  SQLite::Statement running(connection, "SELECT id FROM jobs WHERE state = 'running' ORDER BY id");
  while (running.executeStep()) found.aborted_jobs.push_back({running.getColumn(0).getInt64()});
  return found;
}

bool is_broken_off(const Recovery& found) {
  return found.doing || !found.aborted_jobs.empty() || !found.completed_jobs.empty() || !found.suspects.empty();
}

std::string why_broken_off(const Recovery& found) {
  if (found.doing) return "the program ended " + *found.doing;
  std::vector<std::int64_t> jobs;
  for (const auto& ended : {found.aborted_jobs, found.completed_jobs})
    for (const JobId job : ended) jobs.push_back(job.value);
  if (jobs.empty()) return "the program ended while it cut";
  return fmt::format("the program ended in the middle of job{} {}", jobs.size() == 1 ? "" : "s", fmt::join(jobs, ", "));
}

// "it ended while the head was jogged, job 7 aborted, piece 14 suspect", for the audit log.
std::string describe(const Recovery& found) {
  std::vector<std::string> said;
  if (found.doing) said.push_back("it ended " + *found.doing);
  for (const JobId job : found.aborted_jobs) said.push_back(fmt::format("job {} aborted", job.value));
  for (const JobId job : found.completed_jobs) said.push_back(fmt::format("job {} complete", job.value));
  for (const PieceId piece : found.suspects) said.push_back(fmt::format("piece {} suspect", piece.value));
  return fmt::format("{}", fmt::join(said, ", "));
}

}  // namespace

Result<JobId> JobStore::create(PlanId plan, const std::string& at, const std::optional<KeyedRequest>& request,
                               const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<JobId> {
    if (Status may = database_->may_book(); !may.ok()) return may.error();
    return make_job(connection, plan, at, request, who);
  });
}

Result<JobId> JobStore::create(const NewPlan& plan, const std::string& at, const std::optional<KeyedRequest>& request) {
  auto made = in_transaction(*database_, [&](SQLite::Database& connection) -> Result<JobId> {
    if (Status may = database_->may_book(); !may.ok()) return may.error();
    const auto stored = insert_plan(connection, plan, at);
    if (!stored.ok()) return stored.error();
    return make_job(connection, *stored, at, request, plan.who);
  });
  if (!made) forget_refused(*database_, plan, made.error());
  return made;
}

Status JobStore::cancel(JobId job, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status idle = expect_no_run_of(connection, job); !idle.ok()) return idle;
    if (Status moved = move_job(connection, job, JobState::kCancelled, at, who); !moved.ok()) return moved;
    move_all(connection, job, AllocationState::kReserved, AllocationState::kReleased, at);
    return Ok();
  });
}

Result<RunId> JobStore::start_run(JobId job, const PanelId& panel,
                                  const Isometry2<BedFrame, PanelFrame>& bed_from_panel, Millimetres pose_rms,
                                  const std::string& at, const RunFacts& facts) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<RunId> {
    const OpenRun on = open_run(connection);
    if (on.run.value != 0)
      return Error{ErrorCode::kConflict,
                   fmt::format("run {} of job {} is on: end it first", on.run.value, on.job.value)};
    const auto state = state_of(connection, job);
    if (!state.ok()) return state.error();
    if (*state != JobState::kRunning) {
      if (Status may = database_->may_book(); !may.ok()) return may.error();
      if (Status moved = move_job(connection, job, JobState::kRunning, at, facts.who); !moved.ok())
        return moved.error();
    }
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
    const RunId run{connection.getLastInsertRowid()};
    if (!facts.who.empty()) note_facts(connection, run, facts);
    note_run(connection, facts.who.empty() ? kDaemon : facts.who, "start", run, job, panel, "", at);
    if (facts.looks_again) note_proven(connection, run, at);  // from its first booking on it owes a look
    return run;
  });
}

Status JobStore::mark_cutting(PieceId piece, const std::string& at) {
  return move_one(*database_, piece, AllocationState::kReserved, AllocationState::kCutting, at);
}

Status book_cut(SQLite::Database& connection, PieceId piece, const std::string& at) {
  if (move_piece(connection, piece, AllocationState::kCutting, AllocationState::kCut, at)) return Ok();
  return piece_is_elsewhere(connection, piece, AllocationState::kCut);
}

Status JobStore::book_piece(PieceId piece, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) { return book_cut(connection, piece, at); });
}

Status JobStore::finish_run(RunId run, bool more, const std::string& at, const RunEnd& end) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto job = job_of_open_run(connection, run);
    if (!job.ok()) return job.error();
    if (Status doubted = doubt(connection, end.doubted, at); !doubted.ok()) return doubted;
    if (end.rests) note_rest(connection, at);
    SQLite::Statement left(connection, "SELECT 1 FROM allocations WHERE job = ? AND state = 'reserved' LIMIT 1");
    left.bind(1, job->value);
    const bool goes_on = more && left.executeStep();
    const JobState next = state_after(connection, *job, goes_on ? JobState::kRunning : JobState::kStopped);
    end_run(connection, run, next == JobState::kStopped ? "stopped" : "done", at);
    if (next == JobState::kRunning) return Ok();
    return move_job(connection, *job, next, at, next == JobState::kStopped ? end.who : "");
  });
}

Status JobStore::abort_run(RunId run, std::span<const PieceId> suspects, const std::string& reason,
                           const std::string& at, std::span<const PieceId> neighbours, const std::string& who) {
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
    if (Status doubted = doubt(connection, neighbours, at); !doubted) return doubted;
    end_run(connection, run, reason, at);
    return break_off(connection, *job, JobState::kAborted, at, who);
  });
}

Status JobStore::make_suspect(std::span<const PieceId> pieces, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) { return doubt(connection, pieces, at); });
}

Status JobStore::abort_job(JobId job, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status waits = expect_waiting(connection, job, JobState::kAborted); !waits.ok()) return waits;
    return break_off(connection, job, JobState::kAborted, at, who);
  });
}

Status JobStore::stop_job(JobId job, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status waits = expect_waiting(connection, job, JobState::kStopped); !waits.ok()) return waits;
    return break_off(connection, job, JobState::kStopped, at, who);
  });
}

Status JobStore::stop_job_and_rest(JobId job, const std::string& at, const std::string& doing, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    doing.empty() ? note_rest(connection, at) : note_activity(connection, true, doing, at);
    if (!expect_waiting(connection, job, JobState::kStopped)) return Ok();
    return break_off(connection, job, JobState::kStopped, at, who);
  });
}

Result<PlanId> JobStore::redo(JobId job, const NewPlan& plan, const std::string& at) {
  auto made = in_transaction(*database_, [&](SQLite::Database& connection) -> Result<PlanId> {
    if (Status may = database_->may_book(); !may.ok()) return may.error();
    const auto state = state_of(connection, job);
    if (!state.ok()) return state.error();
    if (*state == JobState::kRunning)
      return Error{ErrorCode::kConflict, fmt::format("job {} is running: stop it first", job.value)};
    for (const PlannedPatch& piece : plan.pieces)
      if (Status gone = give_up(connection, job, piece.mark, plan.who, at); !gone.ok()) return gone.error();
    auto stored = insert_redo(connection, job, plan, at);
    if (!stored.ok()) return stored.error();
    if (Status same = check_masks(connection, *stored); !same.ok()) return same.error();
    SQLite::Statement redone(connection, "INSERT INTO redos (job, plan, at) VALUES (?, ?, ?)");
    SQLite::bind(redone, job.value, stored->value, at);
    redone.exec();
    if (Status reserved = reserve(connection, job, *stored, at); !reserved.ok()) return reserved.error();
    if (*state == JobState::kComplete || *state == JobState::kCancelled)
      if (Status moved = move_job(connection, job, JobState::kStopped, at, plan.who); !moved.ok()) return moved.error();
    return stored;
  });
  if (!made) forget_refused(*database_, plan, made.error());
  return made;
}

Status JobStore::assemble(JobId job, std::span<const std::string> marks, bool assembled, const std::string& who,
                          const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (const auto state = state_of(connection, job); !state.ok()) return state.error();
    for (const std::string& mark : marks)
      if (Status noted = note_assembled(connection, job, mark, assembled, who, at); !noted.ok()) return noted;
    return Ok();
  });
}

Status JobStore::archive(JobId job, bool archived, const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    const auto state = state_of(connection, job);
    if (!state.ok()) return state.error();
    const bool over = *state == JobState::kComplete || *state == JobState::kCancelled;
    if (archived && !over)
      return Error{ErrorCode::kConflict,
                   fmt::format("job {0} is {1}, and only a job that is over is archived: cut it to "
                               "its end, or give it up with veneerctl job cancel {0}",
                               job.value, to_string(*state))};
    if (archived && open_pieces(connection, job) > 0)
      return Error{ErrorCode::kConflict, fmt::format("job {0} has suspect pieces: say what became of them with "
                                                     "veneerctl job settle {0}, then archive it",
                                                     job.value)};
    if (is_archived(connection, job) != archived) note_archived(connection, job, archived, at, who);
    return Ok();
  });
}

Result<std::vector<JobId>> JobStore::archive_done(const std::string& at, const std::string& who) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<std::vector<JobId>> {
    SQLite::Statement rows(
        connection,
        "SELECT j.id FROM jobs AS j WHERE j.state IN ('complete', 'cancelled') AND coalesce((SELECT archived FROM "
        "archivings WHERE job = j.id ORDER BY id DESC LIMIT 1), 0) = 0 AND NOT EXISTS (SELECT 1 FROM piece_states AS s "
        "WHERE s.job = j.id AND (s.state IN ('reserved', 'cutting', 'suspect') OR (j.state = 'complete' AND s.state IN "
        "('unfilled', 'scrap', 'released')))) ORDER BY j.id");
    std::vector<JobId> out;
    while (rows.executeStep()) out.push_back({rows.getColumn(0).getInt64()});
    for (const JobId job : out) note_archived(connection, job, true, at, who);
    return out;
  });
}

Result<std::optional<std::string>> JobStore::would_owe_clear() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<std::string>> {
    if (auto owed = clear_owed(connection)) return owed;
    const Recovery found = found_at_work(connection);
    return is_broken_off(found) ? std::optional(why_broken_off(found)) : std::nullopt;
  });
}

Result<Recovery> JobStore::recover(const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Result<Recovery> {
    Recovery found = found_at_work(connection);
    for (const JobId job : std::exchange(found.aborted_jobs, {})) {
      move_all(connection, job, AllocationState::kCutting, AllocationState::kSuspect, at);
      if (const OpenRun on = open_run(connection); on.run.value != 0 && on.job == job)
        end_run(connection, on.run, "the daemon ended in the middle of it", at);
      const JobState next = state_after(connection, job, JobState::kAborted);
      if (Status moved = move_job(connection, job, next, at); !moved.ok()) return moved.error();
      (next == JobState::kComplete ? found.completed_jobs : found.aborted_jobs).push_back(job);
    }
    if (is_broken_off(found)) {
      append_to_chain(connection, {0, at, kDaemon, "cell.recover", describe(found)});
      note_broken_off(connection, why_broken_off(found), at);
    }
    found.clear_owed = clear_owed(connection);
    return found;
  });
}

}  // namespace veneer::db
