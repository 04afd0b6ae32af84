// What db's .cc files share: where SQLiteCpp's exceptions stop, and the SQL functions of the schema. Private to db.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/VariadicBind.h>
#include <sqlite3.h>

#include <exception>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <type_traits>
#include <vector>

#include "base/frames.h"
#include "base/result.h"
#include "db/database.h"
#include "db/guard.h"

namespace veneer::db {

// One sentence for what SQLite threw: a full disk, a damaged file, a broken rule of the schema.
Error to_error(const SQLite::Exception& thrown, const std::string& file);
// kStorage: `what` is not as it was written.
Error is_damaged(const std::string& file, const std::string& what);
// The `what` of such a sentence, for whoever has another remedy; of another error all that it says.
std::string what_is_damaged(const std::string& file, const Error& error);
// kStorage, by its disk or its permissions.
Error may_not_be_written(const std::filesystem::path& file);
// kStorage: the disk does not say whether there is such a file.
Error cannot_look_at(const std::filesystem::path& file, const std::error_code& failed);
// kInvalidArgument: a SQLite file, but not one of this program.
Error not_ours(const std::filesystem::path& file);
// Was that said of what SQLite threw? Of a row that is not what was written, too, which a trigger finds.
bool means_damage(const SQLite::Exception& thrown);

// Reads. `body` takes the connection and returns a Result or Status.
template <class Body>
auto guarded(Database& database, const Body& body) -> std::invoke_result_t<Body, SQLite::Database&> {
  try {
    database.end_leftover();
    return body(database.connection());
  } catch (const SQLite::Exception& thrown) {
    database.failed(thrown);
    return to_error(thrown, database.file().string());
  }
}

// Writes: one IMMEDIATE transaction, committed last and only when `body` returned ok. Inside of another one it is a
// step of that: written when that one is, so whoever takes several steps ends with the first that fails.
template <class Body>
auto in_transaction(Database& database, const Body& body, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) -> std::invoke_result_t<Body, SQLite::Database&> {
  if (database.guard().writing) return body(database.connection());
  if (Status may = database.may_write(); !may.ok()) return may.error();
  return guarded(database, [&](SQLite::Database& connection) {
    const WritePermission permission(database.guard());
    SQLite::Transaction transaction(connection, SQLite::TransactionBehavior::IMMEDIATE);
    database.look_for_others();
    auto result = body(connection);
    if (!result.ok()) return result;
    transaction.commit();
    if (database.guard().committed) database.guard().committed(file, line);
    return result;
  });
}

// SQLite is C: nothing may be thrown through it.
template <void (*function)(sqlite3_context*, int, sqlite3_value**)>
void without_exceptions(sqlite3_context* context, int count, sqlite3_value** arguments) {
  try {
    function(context, count, arguments);
  } catch (const std::bad_alloc&) {
    sqlite3_result_error_nomem(context);
  } catch (const std::exception& thrown) {
    sqlite3_result_error(context, thrown.what(), -1);
  } catch (...) {
    sqlite3_result_error(context, "a shape cannot be worked with", -1);
  }
}

// What the schema calls: veneer_box and veneer_areas_overlap of the ledger, veneer_checksum of every row,
// veneer_audit_hash of the audit log, veneer_writer, which is 1 and lets nobody delete without it.
void register_functions(SQLite::Database& connection);

inline std::string text(const SQLite::Column& column) { return column.getString(); }
// The first column of every row.
std::vector<std::string> texts_of(SQLite::Database& connection, const std::string& query);
inline std::optional<std::string> text_or_null(const SQLite::Column& column) {
  if (column.isNull()) return std::nullopt;
  return column.getString();
}
// A stored shape that cannot be read means that somebody else wrote the file.
SQLite::Exception damaged(const std::string& what);

// angle_rad, shift_x_mm, shift_y_mm, improper: four columns or parameters from `first` on.
template <class To, class From>
void bind_isometry(SQLite::Statement& statement, int first, const Isometry2<To, From>& map) {
  statement.bind(first, map.angle().count());
  statement.bind(first + 1, map.shift().x.count());
  statement.bind(first + 2, map.shift().y.count());
  statement.bind(first + 3, map.handedness() == Handedness::kImproper ? 1 : 0);
}
template <class To, class From>
Isometry2<To, From> read_isometry(SQLite::Statement& row, int first) {
  return {Radians(row.getColumn(first).getDouble()),
          point<To>(row.getColumn(first + 1).getDouble(), row.getColumn(first + 2).getDouble()),
          row.getColumn(first + 3).getInt() != 0 ? Handedness::kImproper : Handedness::kProper};
}

}  // namespace veneer::db
