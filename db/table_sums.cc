#include "db/table_sums.h"

#include <fmt/format.h>

#include "db/sql.h"

namespace veneer::db {
namespace {

constexpr const char* kSumTable = "table_sums";

struct Sum {
  std::int64_t rows = 0, sum = 0;
};

Sum count(SQLite::Database& connection, const std::string& table) {
  Sum out;
  SQLite::Statement rows(connection, "SELECT checksum FROM " + table);
  while (rows.executeStep()) ++out.rows, out.sum ^= rows.getColumn(0).getInt64();
  return out;
}

// SQLite has no such operator. What both have is taken from what any has, so that nothing overflows.
std::string exclusive_or(const std::string& a, const std::string& b) {
  return fmt::format("(({0} | {1}) - ({0} & {1}))", a, b);
}

std::string trigger(const std::string& table, const char* action, int rows, const std::string& change) {
  return fmt::format(
      "CREATE TRIGGER sums_{0}_{1} AFTER {1} ON {0} BEGIN UPDATE table_sums SET rows = rows + ({2}), sum = {3} WHERE "
      "name = '{0}'; END",
      table, action, rows, exclusive_or("sum", change));
}

}  // namespace

std::vector<std::string> tables_with_checksums(SQLite::Database& connection) {
  return texts_of(
      connection,
      "SELECT t.name FROM sqlite_schema AS t JOIN pragma_table_xinfo(t.name) AS c WHERE t.type = 'table' AND "
      "c.name = 'checksum' ORDER BY t.name");
}

void keep_sums(SQLite::Database& connection) {
  auto tables = tables_with_checksums(connection);
  if (std::erase(tables, kSumTable) == 0) return;
  for (const auto& old : texts_of(connection,
                                  "SELECT name FROM sqlite_schema WHERE type = 'trigger' AND name LIKE 'sums\\_%' "
                                  "ESCAPE '\\'"))
    connection.exec("DROP TRIGGER " + old);
  connection.exec("DELETE FROM table_sums");
  for (const auto& table : tables) {
    const Sum sum = count(connection, table);
    SQLite::Statement row(connection, "INSERT INTO table_sums (name, rows, sum) VALUES (?, ?, ?)");
    SQLite::bind(row, table, sum.rows, sum.sum);
    row.exec();
    connection.exec(trigger(table, "insert", 1, "NEW.checksum"));
    connection.exec(trigger(table, "delete", -1, "OLD.checksum"));
    connection.exec(trigger(table, "update", 0, exclusive_or("OLD.checksum", "NEW.checksum")));
  }
  connection.exec(
      "CREATE TRIGGER sums_are_kept BEFORE DELETE ON table_sums BEGIN SELECT RAISE(ABORT, 'what tables hold is never "
      "forgotten'); END");
}

std::string first_wrong_sum(SQLite::Database& connection) {
  auto tables = tables_with_checksums(connection);
  std::erase(tables, kSumTable);
  for (const auto& table : tables) {
    const Sum found = count(connection, table);
    SQLite::Statement row(connection, "SELECT rows, sum FROM table_sums WHERE name = ?");
    row.bind(1, table);
    if (!row.executeStep()) return fmt::format("how many rows {} has is not known any more", table);
    if (const auto rows = row.getColumn(0).getInt64(); found.rows != rows)
      return fmt::format("{} has {} rows and not {}", table, found.rows, rows);
    if (found.sum != row.getColumn(1).getInt64())
      return fmt::format("the rows of {} are not those that were written last", table);
  }
  return {};
}

}  // namespace veneer::db
