// How the pieces of the last run were cut: kept for as long as the panel may lie as it did.
#include "db/job_store.h"
#include "db/ledger_sql.h"
#include "db/sql.h"

namespace veneer::db {

Status JobStore::book_and_keep(const KeptCut& cut, const std::string& at) {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    if (Status booked = book_cut(connection, cut.piece, at); !booked.ok()) return booked;
    SQLite::Statement insert(connection, "INSERT INTO kept_cuts (piece, run, laser, strokes) VALUES (?, ?, ?, ?)");
    SQLite::bind(insert, cut.piece.value, cut.run.value, cut.laser, cut.strokes_json);
    insert.exec();
    return Ok();
  });
}

Result<std::vector<KeptCut>> JobStore::kept_cuts() {
  return guarded(*database_, [&](SQLite::Database& connection) -> Result<std::vector<KeptCut>> {
    SQLite::Statement rows(connection,
                           "SELECT k.piece, t.mark, k.run, k.laser, k.strokes FROM kept_cuts AS k JOIN pieces AS p ON "
                           "p.id = k.piece JOIN patches AS t ON t.id = p.patch ORDER BY (SELECT max(h.id) FROM "
                           "allocations AS a JOIN allocation_history AS h ON h.allocation = a.id WHERE a.job = p.job "
                           "AND a.piece = p.id AND h.run = k.run AND h.state = 'cut')");
    std::vector<KeptCut> out;
    while (rows.executeStep())
      out.push_back({{rows.getColumn(0).getInt64()},
                     text(rows.getColumn(1)),
                     {rows.getColumn(2).getInt64()},
                     text(rows.getColumn(3)),
                     text(rows.getColumn(4))});
    return out;
  });
}

Status JobStore::forget_cuts() {
  return in_transaction(*database_, [&](SQLite::Database& connection) -> Status {
    connection.exec("DELETE FROM kept_cuts");
    return Ok();
  });
}

}  // namespace veneer::db
