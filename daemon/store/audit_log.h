// Rows of the audit log on their way to the database.
//
// What an operator asks for is written, all of it: whoever asks faster than the disk takes rows has no room, and is to
// ask later, because what a run books waits in the same queue. What needs no login (STOP, a token that opens a session)
// anybody may send as often as he likes, and what only ends something is never put off: of that only so many rows wait
// at a time; the others are counted, and one row tells how many they were. Nothing here waits or refuses. A row that
// the database does not take (a full disk, another program that holds it) is told in the log and kept until it takes
// one again, kMostKept at most.
//
// Bound to the reactor. The database outlives this.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/log.h"
#include "daemon/store/database_thread.h"
#include "db/audit.h"

namespace veneer::daemon {

class AuditLog {
 public:
  static constexpr std::size_t kMostWaiting = 64;
  static constexpr std::size_t kMostKept = 1000;
  static constexpr std::size_t kMostOfOne = 64;  // rows of one identity that wait

  AuditLog(DatabaseThread& database, Logger log);
  ~AuditLog();  // what was counted is written
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Whether this one may ask for more now.
  bool has_room(const std::string& who) const;
  // Without room it is counted.
  void write(db::AuditEntry entry);
  void write_or_count(db::AuditEntry entry);

 private:
  void post(const db::AuditEntry& entry, std::function<void()> then);
  void keep(const db::AuditEntry& entry);
  void write_kept();
  void count_down();
  void write_count();

  DatabaseThread& database_;
  Logger log_;
  std::size_t waiting_ = 0;                        // of what may be counted
  std::map<std::string, std::size_t> waiting_of_;  // of all, by who asked; what is 0 is not in it
  std::size_t counted_ = 0;
  db::AuditEntry last_;  // of those that were counted
  std::vector<db::AuditEntry> kept_;
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace veneer::daemon
