// The reading half of JobStore.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "db/job_sql.h"
#include "db/ledger_sql.h"
#include "db/plan_files.h"
#include "db/shapes.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kJobColumns =
    "SELECT j.id, j.name, j.state, j.created_at, q.target_file, n.preview_file, q.options_json, j.plan, n.id, "
    "coalesce((SELECT archived FROM archivings WHERE job = j.id ORDER BY id DESC LIMIT 1), 0) AS archived FROM jobs "
    "AS j JOIN plans AS q ON q.id = j.plan JOIN plans AS n ON n.id = coalesce((SELECT plan FROM redos WHERE job = j.id "
    "ORDER BY id DESC LIMIT 1), j.plan) ";
std::string piece_columns() {
  return fmt::format(
      "SELECT s.piece, s.job, s.mark, t.artwork_outline_um, l.panel, l.panel_outline_um, s.state, l.angle_rad, "
      "l.shift_x_mm, l.shift_y_mm, l.improper, l.lead_in_um, s.allocation, l.plan, g.seen, g.gone, g.mask_version, "
      "g.at, m.who, m.at FROM piece_states AS s JOIN pieces AS p ON p.id = s.piece JOIN patches AS t ON t.id = p.patch "
      "LEFT JOIN placements AS l ON l.id = s.placement LEFT JOIN allocations AS w ON w.id = s.allocation {}"
      "LEFT JOIN assemblies AS m ON m.assembled = 1 AND m.id = CASE s.state WHEN 'cut' THEN (SELECT max(id) FROM "
      "assemblies WHERE allocation = s.allocation) END ",
      kSightingThatCounts);
}

PieceState piece_state_of(const std::string& name) {
  for (const auto state : {PieceState::kReserved, PieceState::kCutting, PieceState::kCut, PieceState::kSuspect,
                           PieceState::kScrap, PieceState::kReleased})
    if (name == to_string(state)) return state;
  return PieceState::kUnfilled;
}

Seen seen_of(const std::string& name) {
  for (const auto seen : {Seen::kCut, Seen::kStillThere})
    if (name == to_string(seen)) return seen;
  return Seen::kUnclear;
}

JobRecord read_job(SQLite::Database& connection, SQLite::Statement& row) {
  JobRecord job;
  job.id = {row.getColumn(0).getInt64()};
  job.name = text(row.getColumn(1));
  job.state = job_state_of(text(row.getColumn(2)));
  job.created_at = text(row.getColumn(3));
  job.target_file = text(row.getColumn(4));
  job.preview_file = text(row.getColumn(5));
  job.options_json = text(row.getColumn(6));
  job.plan = {row.getColumn(7).getInt64()};
  job.newest = {row.getColumn(8).getInt64()};
  job.archived = row.getColumn(9).getInt() != 0;
  SQLite::Statement counts(connection, "SELECT state, count(*) FROM piece_states WHERE job = ? GROUP BY state");
  counts.bind(1, job.id.value);
  while (counts.executeStep()) job.pieces[piece_state_of(text(counts.getColumn(0)))] = counts.getColumn(1).getInt();
  return job;
}

PieceRecord read_piece_row(SQLite::Statement& row) {
  PieceRecord piece;
  piece.id = {row.getColumn(0).getInt64()};
  piece.job = {row.getColumn(1).getInt64()};
  piece.mark = text(row.getColumn(2));
  const auto artwork = read_ring(text(row.getColumn(3)));
  if (!artwork) throw damaged(fmt::format("piece {}", piece.id.value));
  piece.artwork_outline = from_micro<ArtworkFrame>(*artwork);
  piece.state = piece_state_of(text(row.getColumn(6)));
  if (row.getColumn(4).isNull()) return piece;
  const auto panel = read_ring(text(row.getColumn(5)));
  const auto lead_in = read_ring(text(row.getColumn(11)));
  if (!panel || !lead_in) throw damaged(fmt::format("the place of piece {}", piece.id.value));
  piece.panel = PanelId{text(row.getColumn(4))};
  piece.panel_outline = from_micro<PanelFrame>(*panel);
  if (!lead_in->empty()) piece.lead_in = from_micro<PanelFrame>(*lead_in).front();
  piece.panel_from_artwork = read_isometry<PanelFrame, ArtworkFrame>(row, 7);
  piece.allocation = {row.getColumn(12).getInt64()};
  piece.placed_by = {row.getColumn(13).getInt64()};
  if (!row.getColumn(14).isNull())
    piece.sighting = Sighting{seen_of(text(row.getColumn(14))), row.getColumn(15).getDouble(),
                              row.getColumn(16).getInt(), text(row.getColumn(17))};
  if (!row.getColumn(18).isNull()) piece.assembled = Assembled{text(row.getColumn(18)), text(row.getColumn(19))};
  return piece;
}

}  // namespace

const char* to_string(JobState state) {
  switch (state) {
    case JobState::kPlanned:
      return "planned";
    case JobState::kRunning:
      return "running";
    case JobState::kStopped:
      return "stopped";
    case JobState::kAborted:
      return "aborted";
    case JobState::kComplete:
      return "complete";
    case JobState::kCancelled:
      return "cancelled";
  }
  return "cancelled";
}

const char* to_string(PieceState state) {
  switch (state) {
    case PieceState::kUnfilled:
      return "unfilled";
    case PieceState::kReserved:
      return "reserved";
    case PieceState::kCutting:
      return "cutting";
    case PieceState::kCut:
      return "cut";
    case PieceState::kSuspect:
      return "suspect";
    case PieceState::kScrap:
      return "scrap";
    case PieceState::kReleased:
      return "released";
  }
  return "unfilled";
}

const char* to_string(Seen seen) {
  switch (seen) {
    case Seen::kCut:
      return "cut";
    case Seen::kStillThere:
      return "still_there";
    case Seen::kUnclear:
      return "unclear";
  }
  return "unclear";
}

int JobRecord::count(PieceState wanted) const {
  const auto found = pieces.find(wanted);
  return found == pieces.end() ? 0 : found->second;
}

int JobRecord::missing() const {
  return count(PieceState::kUnfilled) + count(PieceState::kScrap) + count(PieceState::kReleased);
}

JobState job_state_of(const std::string& name) {
  for (const auto state :
       {JobState::kPlanned, JobState::kRunning, JobState::kStopped, JobState::kAborted, JobState::kComplete})
    if (name == to_string(state)) return state;
  return JobState::kCancelled;  // the schema allows no seventh
}

Result<PieceRecord> read_piece(SQLite::Database& connection, PieceId piece) {
  SQLite::Statement row(connection, piece_columns() + "WHERE s.piece = ?");
  row.bind(1, piece.value);
  if (row.executeStep()) return read_piece_row(row);
  return Error{ErrorCode::kNotFound, fmt::format("there is no piece {}: see `veneerctl job pieces`", piece.value)};
}

Result<JobRecord> JobStore::find(JobId job) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<JobRecord> {
    SQLite::Statement row(connection, std::string(kJobColumns) + "WHERE j.id = ?");
    row.bind(1, job.value);
    if (!row.executeStep()) return no_such_job(job);
    return read_job(connection, row);
  });
}

Result<std::vector<JobRecord>> JobStore::list() { return list({0}, -1); }

Result<std::vector<JobRecord>> JobStore::list(JobId after, int limit, bool archived) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<JobRecord>> {
    SQLite::Statement rows(connection,
                           std::string(kJobColumns) + "WHERE j.id > ? AND (? OR archived = 0) ORDER BY j.id LIMIT ?");
    SQLite::bind(rows, after.value, archived ? 1 : 0, limit);
    std::vector<JobRecord> out;
    while (rows.executeStep()) out.push_back(read_job(connection, rows));
    return out;
  });
}

// By how people ordered them last; those that they did not speak of stand behind, by number.
static void put_in_order(SQLite::Database& connection, std::vector<JobWork>& jobs) {
  // Sorted here: SQLite would walk through the list anew for each job.
  std::map<std::int64_t, std::size_t> places;
  SQLite::Statement rows(connection,
                         "SELECT value FROM json_each((SELECT jobs FROM queue_orders ORDER BY id DESC LIMIT 1))");
  while (rows.executeStep()) places.emplace(rows.getColumn(0).getInt64(), places.size());
  std::ranges::sort(jobs, {}, [&](const JobWork& job) {
    const auto named = places.find(job.id.value);
    return std::pair(named == places.end() ? places.size() : named->second, job.id.value);
  });
}

std::vector<JobWork> jobs_with_work(SQLite::Database& connection) {
  // At most one allocation of a piece is neither released nor scrap, and it is the newest.
  SQLite::Statement rows(
      connection,
      "SELECT j.id, j.name, j.state, w.state, w.pieces FROM (SELECT job, state, count(*) AS pieces "
      "FROM allocations WHERE state IN ('reserved', 'cutting', 'suspect') GROUP BY job, state) AS w "
      "JOIN jobs AS j ON j.id = w.job WHERE coalesce((SELECT archived FROM archivings WHERE job = j.id ORDER BY id "
      "DESC LIMIT 1), 0) = 0 ORDER BY j.id");
  std::vector<JobWork> out;
  while (rows.executeStep()) {
    const JobId job{rows.getColumn(0).getInt64()};
    if (out.empty() || out.back().id != job)
      out.push_back({job, text(rows.getColumn(1)), job_state_of(text(rows.getColumn(2)))});
    const bool suspect = piece_state_of(text(rows.getColumn(3))) == PieceState::kSuspect;
    (suspect ? out.back().suspect : out.back().open) += rows.getColumn(4).getInt();
  }
  put_in_order(connection, out);
  return out;
}

Result<std::vector<JobWork>> JobStore::with_work() {
  return guarded(*database_, [](SQLite::Database& connection) -> Result<std::vector<JobWork>> {
    return jobs_with_work(connection);
  });
}

Result<std::vector<JobLoss>> JobStore::with_loss() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<JobLoss>> {
    // Of complete jobs, of which there are many, only those that ever lost wood are looked at piece by piece.
    SQLite::Statement rows(
        connection,
        "SELECT s.job, count(*) FROM piece_states AS s WHERE s.state IN ('unfilled', 'scrap', 'released') AND s.job IN "
        "(SELECT j.id FROM jobs AS j WHERE (j.state IN ('aborted', 'stopped') OR j.state = 'complete' AND EXISTS "
        "(SELECT 1 FROM allocations WHERE job = j.id AND state IN ('scrap', 'released'))) AND NOT EXISTS (SELECT 1 "
        "FROM allocations WHERE job = j.id AND state IN ('reserved', 'cutting', 'suspect')) AND coalesce((SELECT "
        "archived FROM archivings WHERE job = j.id ORDER BY id DESC LIMIT 1), 0) = 0) GROUP BY s.job ORDER BY s.job");
    std::vector<JobLoss> out;
    while (rows.executeStep()) out.push_back({{rows.getColumn(0).getInt64()}, rows.getColumn(1).getInt()});
    return out;
  });
}

Result<std::string> JobStore::plan_json(JobId job) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::string> {
    SQLite::Statement row(
        connection,
        "SELECT q.plan_sha256, q.plan_bytes FROM jobs AS j JOIN plans AS q ON q.id = coalesce((SELECT plan FROM "
        "redos WHERE job = j.id ORDER BY id DESC LIMIT 1), j.plan) WHERE j.id = ?");
    row.bind(1, job.value);
    if (!row.executeStep()) return no_such_job(job);
    return read_plan_file(database_->file(), {text(row.getColumn(0)), row.getColumn(1).getInt64()});
  });
}

Result<std::vector<PieceRecord>> JobStore::pieces(JobId job) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PieceRecord>> {
    SQLite::Statement rows(connection, piece_columns() + "WHERE s.job = ? ORDER BY s.ordinal");
    rows.bind(1, job.value);
    std::vector<PieceRecord> out;
    while (rows.executeStep()) out.push_back(read_piece_row(rows));
    return out;
  });
}

Result<std::vector<PieceRecord>> JobStore::pieces(JobId job, PieceId after, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PieceRecord>> {
    SQLite::Statement rows(connection, piece_columns() + "WHERE s.job = ? AND s.piece > ? ORDER BY s.piece LIMIT ?");
    SQLite::bind(rows, job.value, after.value, limit);
    std::vector<PieceRecord> out;
    while (rows.executeStep()) out.push_back(read_piece_row(rows));
    return out;
  });
}

Result<std::vector<PieceOutcome>> JobStore::outcomes(PieceId after, int limit) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PieceOutcome>> {
    SQLite::Statement rows(
        connection,
        "SELECT s.piece, s.mark, s.job, j.name, j.created_at, l.panel, s.state, coalesce(a.changed_at, ''), r.id, "
        "coalesce(r.started_at, ''), coalesce(r.ended_at, ''), coalesce(r.result, ''), coalesce(f.who, '') "
        "FROM piece_states AS s JOIN jobs AS j ON j.id = s.job "
        "LEFT JOIN placements AS l ON l.id = s.placement LEFT JOIN allocations AS a ON a.id = s.allocation "
        "LEFT JOIN runs AS r ON r.id = (SELECT run FROM allocation_history WHERE allocation = s.allocation AND run IS "
        "NOT NULL ORDER BY id DESC LIMIT 1) LEFT JOIN run_facts AS f ON f.run = r.id "
        "WHERE s.piece > ? ORDER BY s.piece LIMIT ?");
    SQLite::bind(rows, after.value, limit);
    std::vector<PieceOutcome> out;
    while (rows.executeStep()) {
      PieceOutcome& one = out.emplace_back();
      one.piece = {rows.getColumn(0).getInt64()};
      one.mark = text(rows.getColumn(1));
      one.job = {rows.getColumn(2).getInt64()};
      one.job_name = text(rows.getColumn(3)), one.job_made_at = text(rows.getColumn(4));
      if (const auto panel = text_or_null(rows.getColumn(5))) one.panel = PanelId{*panel};
      one.state = piece_state_of(text(rows.getColumn(6)));
      one.since = text(rows.getColumn(7));
      if (!rows.getColumn(8).isNull()) one.run = RunId{rows.getColumn(8).getInt64()};
      one.run_started_at = text(rows.getColumn(9)), one.run_ended_at = text(rows.getColumn(10));
      one.run_result = text(rows.getColumn(11)), one.who = text(rows.getColumn(12));
    }
    return out;
  });
}

Result<PieceRecord> JobStore::find_piece(PieceId piece) {
  return guarded(*database_, [&](SQLite::Database& connection) { return read_piece(connection, piece); });
}

Result<PieceRecord> JobStore::find_piece(JobId job, const std::string& mark) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<PieceRecord> {
    SQLite::Statement row(connection, piece_columns() + "WHERE s.job = ? AND s.mark = ?");
    SQLite::bind(row, job.value, mark);
    if (row.executeStep()) return read_piece_row(row);
    SQLite::Statement known(connection, "SELECT 1 FROM jobs WHERE id = ?");
    known.bind(1, job.value);
    if (!known.executeStep()) return no_such_job(job);
    return no_such_piece(job, mark);
  });
}

Result<std::vector<PieceStep>> JobStore::history(PieceId piece) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PieceStep>> {
    SQLite::Statement rows(connection,
                           "SELECT a.id, a.panel, h.state, h.at, h.run FROM pieces AS p JOIN allocations AS a ON a.job "
                           "= p.job AND a.piece = p.id JOIN allocation_history AS h ON h.allocation = a.id WHERE p.id "
                           "= ? ORDER BY h.id");
    rows.bind(1, piece.value);
    std::vector<PieceStep> out;
    while (rows.executeStep()) {
      PieceStep& step = out.emplace_back(PieceStep{{rows.getColumn(0).getInt64()},
                                                   {text(rows.getColumn(1))},
                                                   allocation_state_of(text(rows.getColumn(2))),
                                                   text(rows.getColumn(3)),
                                                   std::nullopt});
      if (!rows.getColumn(4).isNull()) step.run = RunId{rows.getColumn(4).getInt64()};
    }
    return out;
  });
}

Result<RunFacts> JobStore::facts(RunId run) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<RunFacts> {
    RunFacts facts;
    SQLite::Statement row(connection, "SELECT who, recipes FROM run_facts WHERE run = ?");
    row.bind(1, run.value);
    if (!row.executeStep()) return facts;
    facts.who = text(row.getColumn(0));
    facts.recipes_json = text(row.getColumn(1));
    SQLite::Statement certificates(connection,
                                   "SELECT c.value FROM run_facts, json_each(certificates) AS c WHERE run = ?");
    certificates.bind(1, run.value);
    while (certificates.executeStep()) facts.certificates.push_back({certificates.getColumn(0).getInt64()});
    return facts;
  });
}

// Of a row of kRunColumns.
static constexpr const char* kRunColumns =
    "SELECT id, panel, pose_rms_mm, started_at, ended_at, result, angle_rad, shift_x_mm, shift_y_mm, improper, job "
    "FROM runs ";
static RunRecord read_run(SQLite::Statement& row) {
  return {{row.getColumn(0).getInt64()},
          {row.getColumn(10).getInt64()},
          {text(row.getColumn(1))},
          read_isometry<BedFrame, PanelFrame>(row, 6),
          Millimetres(row.getColumn(2).getDouble()),
          text(row.getColumn(3)),
          text_or_null(row.getColumn(4)),
          text(row.getColumn(5))};
}

Result<std::vector<RunRecord>> JobStore::runs(JobId job) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<RunRecord>> {
    SQLite::Statement rows(connection, std::string(kRunColumns) + "WHERE job = ? ORDER BY id");
    rows.bind(1, job.value);
    std::vector<RunRecord> out;
    while (rows.executeStep()) out.push_back(read_run(rows));
    return out;
  });
}

Result<std::optional<RunRecord>> JobStore::last_run() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<RunRecord>> {
    SQLite::Statement row(connection, std::string(kRunColumns) + "ORDER BY id DESC LIMIT 1");
    if (!row.executeStep()) return std::optional<RunRecord>();
    return std::optional(read_run(row));
  });
}

Result<std::vector<PlanId>> JobStore::redos(JobId job) {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<PlanId>> {
    SQLite::Statement rows(connection, "SELECT plan FROM redos WHERE job = ? ORDER BY id");
    rows.bind(1, job.value);
    std::vector<PlanId> out;
    while (rows.executeStep()) out.push_back({rows.getColumn(0).getInt64()});
    return out;
  });
}

}  // namespace veneer::db
