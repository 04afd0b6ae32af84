#include "db/integrity.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <vector>

#include "db/migrations.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

std::vector<std::string> texts_of(SQLite::Database& connection, const std::string& query) {
  SQLite::Statement rows(connection, query);
  std::vector<std::string> out;
  while (rows.executeStep()) out.push_back(text(rows.getColumn(0)));
  return out;
}

// One text for each table, index, trigger and view. The R*Tree's own tables are SQLite's, and statistics may be there.
std::vector<std::string> schema_of(SQLite::Database& connection) {
  return texts_of(connection,
                  "SELECT type || ' ' || name || ' ' || tbl_name || ' ' || coalesce(sql, '') FROM sqlite_schema WHERE "
                  "name NOT LIKE 'allocation\\_boxes\\_%' ESCAPE '\\' AND name NOT LIKE 'sqlite\\_stat%' ESCAPE '\\' "
                  "ORDER BY type, name");
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
Newest newest_schema() {
  SQLite::Database fresh(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  register_functions(fresh);
  // The migrations are the program's own: they work, or no database would.
  if (const Status made = migrate(fresh, migrations()); !made.ok())
    throw SQLite::Exception("the newest schema cannot be made: " + made.error().message);
  return {schema_of(fresh), moves_of(fresh)};
}

// The name of the first of `found` that differs.
std::string first_difference(const std::vector<std::string>& found, const std::vector<std::string>& wanted) {
  const auto [f, w] = std::mismatch(found.begin(), found.end(), wanted.begin(), wanted.end());
  const std::string& entry = f != found.end() && (w == wanted.end() || *f < *w) ? *f : *w;
  return entry.substr(0, entry.find(' ', entry.find(' ') + 1));
}

std::vector<std::string> tables_with_checksums(SQLite::Database& connection) {
  return texts_of(
      connection,
      "SELECT t.name FROM sqlite_schema AS t JOIN pragma_table_xinfo(t.name) AS c WHERE t.type = 'table' AND "
      "c.name = 'checksum' ORDER BY t.name");
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

// A number that was handed out is never handed out again.
Status check_numbers(SQLite::Database& connection, const std::string& file) {
  for (const auto& table :
       texts_of(connection, "SELECT name FROM sqlite_schema WHERE type = 'table' AND sql LIKE '%AUTOINCREMENT%'")) {
    const int lost = connection
                         .execAndGet(fmt::format("SELECT coalesce((SELECT max(rowid) FROM {0}), 0) > coalesce((SELECT "
                                                 "seq FROM sqlite_sequence WHERE name = '{0}'), 0)",
                                                 table))
                         .getInt();
    if (lost != 0) return is_damaged(file, fmt::format("the last number of {} is not known", table));
  }
  return Ok();
}

}  // namespace

Status check_pages(SQLite::Database& connection, const std::string& file) {
  const std::string verdict = connection.execAndGet("PRAGMA integrity_check(1)").getString();
  if (verdict != "ok") return is_damaged(file, verdict.substr(0, verdict.find('\n')));
  SQLite::Statement keys(connection, "PRAGMA foreign_key_check");
  if (keys.executeStep())
    return is_damaged(file, fmt::format("table {} points to a row that is not there", text(keys.getColumn(0))));
  return Ok();
}

Status check_schema(SQLite::Database& connection, const std::string& file) {
  const Newest wanted = newest_schema();
  if (const auto found = schema_of(connection); found != wanted.schema)
    return is_damaged(file, fmt::format("its {} is not this program's", first_difference(found, wanted.schema)));
  if (moves_of(connection) != wanted.moves) return is_damaged(file, "the moves between states are not this program's");
  return Ok();
}

Status check_all(SQLite::Database& connection, const std::string& file) {
  if (Status pages = check_pages(connection, file); !pages.ok()) return pages;
  if (Status schema = check_schema(connection, file); !schema.ok()) return schema;
  for (const auto& table : tables_with_checksums(connection))
    if (Status rows = check_rows(connection, table, file); !rows.ok()) return rows;
  if (Status boxes = check_boxes(connection, file); !boxes.ok()) return boxes;
  return check_numbers(connection, file);
}

}  // namespace veneer::db
