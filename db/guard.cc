#include "db/guard.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace veneer::db {
namespace {

constexpr std::string_view kBoxes = "allocation_boxes", kSums = "table_sums";

// Those that change nothing but their own answer.
bool may_have_argument(std::string_view pragma) {
  constexpr std::array<std::string_view, 7> kHarmless = {"integrity_check", "quick_check", "foreign_key_check",
                                                         "table_info",      "table_xinfo", "wal_checkpoint",
                                                         "max_page_count"};
  return std::find(kHarmless.begin(), kHarmless.end(), pragma) != kHarmless.end();
}

bool may_write(const Guard& guard, std::string_view table, bool in_trigger) {
  // SQLite asks for this when it makes a table of its own for a pragma; nobody writes there (DEFENSIVE).
  if (table == "sqlite_master") return true;
  if (table.starts_with("sqlite_")) return false;
  if (table == kBoxes || table == kSums) return in_trigger;
  // The R*Tree's own tables: SQLite writes them itself, and refuses everybody else (SQLITE_DBCONFIG_DEFENSIVE).
  if (table.starts_with(kBoxes)) return true;
  return guard.writing;
}

int authorize(void* of, int action, const char* first, const char* second, const char*, const char* trigger) {
  const Guard& guard = *static_cast<const Guard*>(of);
  switch (action) {
    case SQLITE_SELECT:
    case SQLITE_READ:
    case SQLITE_RECURSIVE:
    case SQLITE_TRANSACTION:
    case SQLITE_SAVEPOINT:
      return SQLITE_OK;
    case SQLITE_FUNCTION:
      return std::string_view(second) == "load_extension" ? SQLITE_DENY : SQLITE_OK;
    case SQLITE_PRAGMA:
      return second == nullptr || may_have_argument(first) ? SQLITE_OK : SQLITE_DENY;
    case SQLITE_INSERT:
    case SQLITE_UPDATE:
    case SQLITE_DELETE:
      return may_write(guard, first, trigger != nullptr) ? SQLITE_OK : SQLITE_DENY;
    default:
      return SQLITE_DENY;
  }
}

}  // namespace

void set_guard(SQLite::Database& connection, Guard& guard) {
  sqlite3_db_config(connection.getHandle(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_set_authorizer(connection.getHandle(), &authorize, &guard);
}

}  // namespace veneer::db
