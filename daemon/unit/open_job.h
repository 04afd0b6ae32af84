// What of a job is still to be cut, and whether this cell may cut it.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/runner_options.h"
#include "db/job_store.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

struct OpenJob {
  std::string name;
  std::vector<db::PieceRecord> pieces;  // that are reserved, one or more, panel by panel
};

// With a sentence that says what is missing: a certificate that a cut needs, wood that is there (seen_wood.h), a piece
// that is still to be cut. On the database's thread.
Result<OpenJob> load_open_job(Repositories& repositories, JobId job);

// kRefused for a laser that must not cut wood of the stock: the scanner or the camera beside it is simulated, it does
// not find its corner, or it burns nothing. Pure.
Status check_cuts_stock(const RunnerOptions& options, const LaserLimits& limits);

}  // namespace veneer::daemon
