// What happened to wood, pieces, runs, jobs, panels and the cell, in one list by time (the view `events`, of which
// docs/SCHEMA.md says what is in it).
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

inline constexpr auto kEventKinds =
    std::to_array<std::string_view>({"assembly", "cell", "difference", "edit", "job", "lease", "mask", "merge", "panel",
                                     "proposal", "remnant", "run", "scan", "sighting", "treatment", "verdict", "wood"});

struct EventRecord {
  std::string at;
  std::string kind;       // one of kEventKinds
  std::int64_t step = 0;  // orders those of one kind and part within an instant
  int part = 0;           // of what is told of its kind: a run's beginning is part 0, its end part 1
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
  std::string kind = {};   // exactly; "" of whatever kind
  std::optional<PanelId> panel = {};
  std::optional<JobId> job = {};
  std::optional<PieceId> piece = {};
};

// Where a list goes on: behind the event that has these, which no other has together. Events that come and go before
// and behind it, in the same instant too, shift nothing.
struct EventPlace {
  std::string at = {};
  std::string kind = {};
  int part = 0;
  std::int64_t step = 0;
  std::string panel = {};  // "" of no panel
};
EventPlace place_of(const EventRecord& event);

class Events {
 public:
  explicit Events(Database& database) : database_(&database) {}

  // In the order of their places, the oldest first, at most `limit`. An index tells where a list begins, and which
  // wood, pieces and runs are of a job, a panel or a piece. A clock that is set back puts events before places that
  // were told.
  Result<std::vector<EventRecord>> read(const EventFilter& filter, const EventPlace& after, int limit);

 private:
  Database* database_;
};

}  // namespace veneer::db
