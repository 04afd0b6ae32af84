// What a scan saw of wood that is suspect: noted until somebody says what became of it, and nothing is decided.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/stock/seen_sheet.h"
#include "daemon/store/database_thread.h"
#include "db/job_store.h"

namespace veneer::daemon {

// What a scan saw of a suspect piece's wood: a proposal.
struct SeenSuspect {
  JobId job;
  std::string mark;
  db::Sighting sighting;
};

struct SeenSuspects {
  std::vector<SeenSuspect> told;
  std::vector<std::pair<db::AllocationId, db::Sighting>> noted;  // the same
};

// Of wood that is suspect still, and was when the scan's first picture was taken. `at`: of a scan that names no tile.
// On the database's thread.
Result<SeenSuspects> see_suspects(Repositories& r, const SeenSheet& seen, const std::string& at);

}  // namespace veneer::daemon
