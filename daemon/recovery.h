// What the daemon before this one left behind, however it ended: the unit and the database begin with it.
#pragma once

#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/job_runner.h"

namespace veneer::daemon {

// What a crash left behind, and what to say of it.
struct Recovered {
  db::Recovery found;
  std::vector<std::string> sentences;
  std::vector<std::string> ended_leases;  // the daemon was off when their time came
};

// On the database's thread.
Result<Recovered> recover(Repositories& r);
// Says it, and hands it to the unit. On the reactor.
void begin_after(JobRunner& runner, const Recovered& recovered, const Logger& log);

}  // namespace veneer::daemon
