#include "db/done_by_sql.h"
#include "db/sql.h"

namespace veneer::db {
namespace {

const char* to_string(Done what) {
  switch (what) {
    case Done::kJobMade:
      return "made";
    case Done::kJobMoved:
      return "job";
    case Done::kJobArchived:
      return "archiving";
    case Done::kPanelRetired:
      return "retirement";
    case Done::kLeaseEnded:
      return "lease";
  }
  return "job";
}

}  // namespace

void note_done_by(SQLite::Database& connection, Done what, std::int64_t number, const std::string& who) {
  if (who.empty()) return;
  SQLite::Statement insert(connection, "INSERT INTO done_by (kind, number, who) VALUES (?, ?, ?)");
  SQLite::bind(insert, to_string(what), number, who);
  insert.exec();
}

}  // namespace veneer::db
