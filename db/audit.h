// Who did what, when. Append-only: the database refuses changes and deletions, and each row carries a hash of the row
// before it, so that rows which somebody changed all the same are found (db/audit_chain.h).
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "db/database.h"
#include "db/panels.h"

namespace veneer::db {

struct AuditEntry {
  std::int64_t id = 0;  // 0 on insertion
  std::string at;
  std::string who;        // "uid 1000", "console link 3 of uid 1000", "anonymous", kDaemon
  std::string what;       // "api.cancelJob", "job.start"
  std::string detail;     // free text
  std::string hash = {};  // of the chain; the database's own
};

// Who did what the program did by itself.
inline constexpr const char* kDaemon = "veneerd";

// What a choice of a device is noted as, before it is kept; and again when it could not be.
inline constexpr const char* kDeviceChosen = "device.choose";
inline constexpr const char* kDeviceNotChosen = "device.choose.failed";

// The last row: its number and hash. Written down elsewhere, it proves later that nothing before it was rewritten.
struct AuditHead {
  std::int64_t id = 0;  // 0 and "" of a log without rows
  std::string hash = {};
};

// All that is given must hold.
struct AuditFilter {
  std::string since = {};                   // at or after this time
  std::string until = {};                   // before this time
  std::string who = {};                     // exactly
  std::string what = {};                    // exactly
  std::string kind = {};                    // the beginning of its `what`, up to the dot: "run", "alarm"
  std::vector<std::string> words = {};      // each is somewhere in the row; A to Z are as a to z
  std::optional<PanelId> panel = {};        // its detail names this panel
  std::optional<JobId> job = {};            // and this job
  std::optional<std::int64_t> before = {};  // smaller numbers
};

class Audit {
 public:
  explicit Audit(Database& database) : database_(&database) {}

  Status append(const AuditEntry& entry);
  Result<std::vector<AuditEntry>> read(const AuditFilter& filter, int count);  // newest first
  Result<std::vector<AuditEntry>> latest(int count) { return read({}, count); }
  // Whether any choice of a device was kept, by an index: as far as is known, more were made than failed.
  Result<bool> devices_were_chosen();
  Result<AuditHead> head();

 private:
  Database* database_;
};

}  // namespace veneer::db
