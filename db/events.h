// What happened to wood, pieces, runs, jobs, panels and the cell, in one list by time (the view `events`, of which
// docs/SCHEMA.md says what is in it).
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

struct EventRecord {
  std::string at;
  std::int64_t step = 0;  // orders those of one kind within an instant
  std::string kind;       // "wood", "job", "panel", ...
  std::optional<PanelId> panel;
  std::optional<JobId> job;
  std::optional<PieceId> piece;
  std::optional<std::int64_t> run;
  std::string what;  // "cut", "cancelled", "retired", "lease of plan 5 expired", ...
  std::string who;   // "" where nobody noted it, or the cell did it by itself
};

// All that is given must hold.
struct EventFilter {
  std::string since = {};  // at or after this time
  std::string until = {};  // before this time
  std::string kind = {};   // exactly
  std::optional<PanelId> panel = {};
  std::optional<JobId> job = {};
  std::optional<PieceId> piece = {};
};

// Where a list goes on: behind the first `told` events of the instant `at`. Two events may have all but this in common.
struct EventPlace {
  std::string at = {};
  std::int64_t told = 0;
};

class Events {
 public:
  explicit Events(Database& database) : database_(&database) {}

  // The oldest first, at most `limit`. Of a job, a panel or a piece an index tells; without any of them all that
  // happened since is looked at.
  Result<std::vector<EventRecord>> read(const EventFilter& filter, const EventPlace& after, int limit);

 private:
  Database* database_;
};

}  // namespace veneer::db
