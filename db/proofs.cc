// Up to which booking of a run its panel was seen where it has to lie: the newest row of `proofs`.
#include <fmt/format.h>

#include "db/audit_chain.h"
#include "db/job_sql.h"
#include "db/job_store.h"
#include "db/ledger_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

// The steps by which a run booked its pieces: what a person says of one later is no such step.
constexpr const char* kBookings =
    "FROM runs AS r JOIN allocations AS a ON a.job = r.job AND a.panel = r.panel JOIN allocation_history AS h ON "
    "h.allocation = a.id AND h.run = r.id AND h.state = 'cut' WHERE r.id = ?1 AND (SELECT state FROM "
    "allocation_history WHERE allocation = a.id AND id < h.id ORDER BY id DESC LIMIT 1) = 'cutting' ";

}  // namespace

void note_proven(SQLite::Database& connection, RunId run, const std::string& at) {
  SQLite::Statement booked(connection, std::string("SELECT count(*), max(h.id) ") + kBookings);
  booked.bind(1, run.value);
  booked.executeStep();
  const int pieces = booked.getColumn(0).getInt();
  SQLite::Statement insert(connection, "INSERT INTO proofs (run, step, at) VALUES (?1, nullif(?2, 0), ?3)");
  SQLite::bind(insert, run.value, booked.getColumn(1).getInt64(), at);
  insert.exec();
  SQLite::Statement of(connection, "SELECT job, panel FROM runs WHERE id = ?");
  of.bind(1, run.value);
  of.executeStep();
  append_to_chain(connection, {0, at, kDaemon, "run.proven",
                               fmt::format("run {} of job {} on {}, {} pieces cut before", run.value,
                                           of.getColumn(0).getInt64(), text(of.getColumn(1)), pieces)});
}

Status JobStore::note_proof(RunId run, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    SQLite::Statement known(connection, "SELECT 1 FROM runs WHERE id = ?");
    known.bind(1, run.value);
    if (!known.executeStep()) return Error{ErrorCode::kNotFound, fmt::format("there is no run {}", run.value)};
    note_proven(connection, run, at);
    return Ok();
  });
}

Result<std::optional<UnprovenCuts>> JobStore::unproven() {
  auto run = last_run();
  if (!run) return run.error();
  if (!*run) return std::optional<UnprovenCuts>();
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::optional<UnprovenCuts>> {
    SQLite::Statement newest(connection, "SELECT coalesce(step, 0) FROM proofs WHERE run = ? ORDER BY id DESC LIMIT 1");
    newest.bind(1, (*run)->id.value);
    if (!newest.executeStep()) return std::optional<UnprovenCuts>();
    SQLite::Statement rows(connection, std::string("SELECT a.piece, a.state = 'cut' AND h.id = (SELECT max(id) FROM "
                                                   "allocation_history WHERE allocation = a.id) ") +
                                           kBookings + "AND h.id > ?2 ORDER BY h.id");
    SQLite::bind(rows, (*run)->id.value, newest.getColumn(0).getInt64());
    UnprovenCuts out{std::move(**run), {}};
    while (rows.executeStep())
      if (rows.getColumn(1).getInt() != 0) out.pieces.push_back({rows.getColumn(0).getInt64()});
    return out.pieces.empty() ? std::optional<UnprovenCuts>() : std::optional(std::move(out));
  });
}

}  // namespace veneer::db
