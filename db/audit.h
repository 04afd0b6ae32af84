// Who did what, when. Append-only: the database refuses changes and deletions.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

struct AuditEntry {
  std::int64_t id = 0;  // 0 on insertion
  std::string at;
  std::string who;     // "uid 1000", "console link 3 of uid 1000", "anonymous"
  std::string what;    // "api.cancelJob", "job.start"
  std::string detail;  // free text
};

class Audit {
 public:
  explicit Audit(Database& database) : database_(&database) {}

  Status append(const AuditEntry& entry);
  Result<std::vector<AuditEntry>> latest(int count);  // newest first

 private:
  Database* database_;
};

}  // namespace veneer::db
