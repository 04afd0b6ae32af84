#include "db/integrity.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "db/audit_chain.h"
#include "db/migrations.h"
#include "db/sql.h"
#include "db/table_sums.h"

namespace veneer::db {
namespace {

// One text for each table, index, trigger and view, in order. Statistics may be there. Tables that SQLite made by
// itself, the R*Tree's among them, are told by what they are: their words in the schema are those of the SQLite that
// made the file, and another one may word them otherwise. Of rules that no pragma tells, which none of them has, it is
// told whether their words are there.
std::vector<std::string> schema_of(SQLite::Database& connection) {
  std::string rules;
  for (const char* rule : {"CHECK", "REFERENCES", "COLLATE", "CONFLICT", "AUTOINCREMENT"})
    rules += fmt::format(" || (s.sql LIKE '%{}%')", rule);
  auto out = texts_of(
      connection,
      fmt::format("SELECT s.type || ' ' || s.name || ' ' || s.tbl_name || ' ' || CASE WHEN s.type = 'table' AND "
                  "(s.name = 'sqlite_sequence' OR l.type = 'shadow') THEN (SELECT l.wr || l.strict || "
                  "group_concat(printf(',%Q %Q %d %Q %d %d', name, upper(type), \"notnull\", dflt_value, pk, hidden), "
                  "'') FROM (SELECT * FROM pragma_table_xinfo(s.name) ORDER BY cid)){} ELSE coalesce(s.sql, '') END "
                  "FROM sqlite_schema AS s LEFT JOIN pragma_table_list AS l ON l.name = s.name AND l.schema = 'main' "
                  "WHERE s.name NOT LIKE 'sqlite\\_stat%' ESCAPE '\\'",
                  rules));
  std::ranges::sort(out);
  return out;
}

// What may follow what.
std::vector<std::string> moves_of(SQLite::Database& connection) {
  return texts_of(connection,
                  "SELECT 'wood ' || from_state || ' ' || to_state FROM allocation_moves UNION ALL "
                  "SELECT 'job ' || from_state || ' ' || to_state FROM job_moves ORDER BY 1");
}

struct Newest {
  std::vector<std::string> schema, moves;
};
// Made once: a database is opened for each connection and each backup, and the migrations take longer than all else
// that an opening does.
const Newest& newest_schema() {
  static const Newest kNewest = [] {
    SQLite::Database fresh(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    register_functions(fresh);
    // The migrations are the program's own: they work, or no database would.
    if (const Status made = migrate(fresh, migrations()); !made.ok())
      throw SQLite::Exception("the newest schema cannot be made: " + made.error().message);
    return Newest{schema_of(fresh), moves_of(fresh)};
  }();
  return kNewest;
}

// The name of the first of `found` that differs; both are in order.
std::string first_difference(const std::vector<std::string>& found, const std::vector<std::string>& wanted) {
  const auto [f, w] = std::mismatch(found.begin(), found.end(), wanted.begin(), wanted.end());
  const std::string& entry = f != found.end() && (w == wanted.end() || *f < *w) ? *f : *w;
  return entry.substr(0, entry.find(' ', entry.find(' ') + 1));
}

// Rows whose checksum is not that of their columns.
Status check_rows(SQLite::Database& connection, const std::string& table, const std::string& file) {
  std::string columns;
  for (const auto& column : texts_of(
           connection, fmt::format("SELECT name FROM pragma_table_xinfo('{}') WHERE hidden = 0 ORDER BY cid", table)))
    columns += ", " + column;
  const int changed = connection
                          .execAndGet(fmt::format("SELECT count(*) FROM {0} WHERE checksum IS NOT "
                                                  "veneer_checksum('{0}'{1})",
                                                  table, columns))
                          .getInt();
  if (changed == 0) return Ok();
  return is_damaged(
      file, fmt::format("{} of the rows of {} {} not what was written", changed, table, changed == 1 ? "is" : "are"));
}

Status check_boxes(SQLite::Database& connection, const std::string& file) {
  if (const std::string verdict = connection.execAndGet("SELECT rtreecheck('allocation_boxes')").getString();
      verdict != "ok")
    return is_damaged(file, verdict.substr(0, verdict.find('\n')));
  const int wrong =
      connection
          .execAndGet(
              "SELECT abs((SELECT count(*) FROM allocation_boxes) - (SELECT count(*) FROM allocations WHERE state <> "
              "'released')) + (SELECT count(*) FROM allocations AS a JOIN panels AS p ON p.id = a.panel LEFT JOIN "
              "allocation_boxes AS b ON b.id = a.id WHERE a.state <> 'released' AND (b.min_panel, b.max_panel, "
              "b.min_x, "
              "b.max_x, b.min_y, b.max_y) IS NOT (p.number, p.number, veneer_box(a.area_um, 0), veneer_box(a.area_um, "
              "1), veneer_box(a.area_um, 2), veneer_box(a.area_um, 3)))")
          .getInt();
  if (wrong == 0) return Ok();
  return is_damaged(file, fmt::format("the index of wood is wrong about {} allocations", wrong));
}

// Wood is in the state that its history ends with.
Status check_histories(SQLite::Database& connection, const std::string& file) {
  const int wrong =
      connection
          .execAndGet(
              "SELECT count(*) FROM allocations AS a WHERE (a.state, a.changed_at) IS NOT (SELECT h.state, "
              "h.at FROM allocation_history AS h WHERE h.allocation = a.id ORDER BY h.id DESC LIMIT 1)")
          .getInt();
  if (wrong == 0) return Ok();
  return is_damaged(file, fmt::format("{} allocations are not in the state that their history ends with", wrong));
}

// Wood is leased while its lease lasts, and no longer.
Status check_leases(SQLite::Database& connection, const std::string& file) {
  const int wrong = connection
                        .execAndGet(
                            "SELECT count(*) FROM allocations AS a JOIN leases AS e ON e.id = a.lease WHERE (a.state = "
                            "'leased') <> (e.ended IS NULL)")
                        .getInt();
  if (wrong == 0) return Ok();
  return is_damaged(file, fmt::format("{} leased allocations do not follow their lease", wrong));
}

// A number that was handed out is never handed out again, and of a table that keeps all its rows the last is there.
Status check_numbers(SQLite::Database& connection, const std::string& file) {
  for (const auto& table :
       texts_of(connection, "SELECT name FROM sqlite_schema WHERE type = 'table' AND sql LIKE '%AUTOINCREMENT%'")) {
    const auto number = [&](const std::string& query) { return connection.execAndGet(query).getInt64(); };
    const auto newest = number(fmt::format("SELECT coalesce(max(rowid), 0) FROM {}", table));
    const auto handed_out =
        number(fmt::format("SELECT coalesce((SELECT seq FROM sqlite_sequence WHERE name = '{}'), 0)", table));
    if (newest > handed_out) return is_damaged(file, fmt::format("the last number of {} is not known", table));
    const bool keeps_all =
        number(fmt::format("SELECT count(*) FROM sqlite_schema WHERE type = 'trigger' AND tbl_name = "
                           "'{}' AND sql LIKE '%BEFORE DELETE ON%' AND sql NOT LIKE '%WHEN %'",
                           table)) > 0;
    if (keeps_all && newest < handed_out) return is_damaged(file, fmt::format("the last row of {} is gone", table));
  }
  return Ok();
}

}  // namespace

namespace {

// What kept SQLite from reading the page that is spoken of (a disk, memory): that says nothing about what is written
// there. 0 when it was read.
int why_not_read(const std::string& verdict) {
  constexpr std::string_view kCode = "error code=";
  const auto at = verdict.find(kCode);
  if (at == std::string::npos) return verdict.find("failed to get page") == std::string::npos ? 0 : SQLITE_IOERR;
  const int code = std::atoi(verdict.c_str() + at + kCode.size()) & 0xff;
  return code == SQLITE_CORRUPT || code == SQLITE_NOTADB ? 0 : code;
}

}  // namespace

Status check_pages(SQLite::Database& connection, const std::string& file) {
  std::string verdict = connection.execAndGet("PRAGMA integrity_check(1)").getString();
  if (const int code = why_not_read(verdict); code != 0) throw SQLite::Exception("a page cannot be read", code);
  if (constexpr std::string_view kHead = "*** in database main ***\n"; verdict.starts_with(kHead))
    verdict.erase(0, kHead.size());
  if (verdict != "ok") return is_damaged(file, verdict.substr(0, verdict.find('\n')));
  SQLite::Statement keys(connection, "PRAGMA foreign_key_check");
  if (keys.executeStep())
    return is_damaged(file, fmt::format("table {} points to a row that is not there", text(keys.getColumn(0))));
  return Ok();
}

Status check_schema(SQLite::Database& connection, const std::string& file) {
  const Newest& wanted = newest_schema();
  if (const auto found = schema_of(connection); found != wanted.schema)
    return is_damaged(file, fmt::format("its {} is not this program's", first_difference(found, wanted.schema)));
  if (moves_of(connection) != wanted.moves) return is_damaged(file, "the moves between states are not this program's");
  return Ok();
}

Status check_all(SQLite::Database& connection, const std::string& file) {
  // All of it of one moment: a row that another connection adds between two questions would look like one that is gone.
  const SQLite::Transaction moment(connection, SQLite::TransactionBehavior::DEFERRED);
  if (Status pages = check_pages(connection, file); !pages.ok()) return pages;
  if (Status schema = check_schema(connection, file); !schema.ok()) return schema;
  // First, since it names the row.
  if (Status chain = check_chain(connection, file); !chain.ok()) return chain;
  for (const auto& table : tables_with_checksums(connection))
    if (Status rows = check_rows(connection, table, file); !rows.ok()) return rows;
  if (Status boxes = check_boxes(connection, file); !boxes.ok()) return boxes;
  if (Status histories = check_histories(connection, file); !histories.ok()) return histories;
  if (Status leases = check_leases(connection, file); !leases.ok()) return leases;
  if (Status numbers = check_numbers(connection, file); !numbers.ok()) return numbers;
  // Last, since the others say more.
  if (const std::string wrong = first_wrong_sum(connection); !wrong.empty()) return is_damaged(file, wrong);
  return Ok();
}

}  // namespace veneer::db
