#include "daemon/unit/open_job.h"

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/store/calibration.h"
#include "daemon/unit/job_words.h"
#include "daemon/unit/seen_wood.h"

namespace veneer::daemon {

Result<OpenJob> load_open_job(Repositories& repositories, JobId job) {
  auto calibration = load_calibration(repositories, utc_timestamp());
  if (!calibration) return calibration.error();
  if (const Status ready = require_cutting(*calibration); !ready) return ready.error();
  auto record = repositories.jobs.find(job);
  if (!record) return record.error();
  auto pieces = repositories.jobs.pieces(job);
  if (!pieces) return pieces.error();
  if (const Status there = check_wood_is_there(repositories, *pieces); !there) return there.error();
  OpenJob open{record->name, {}};
  for (auto& piece : *pieces)
    if (piece.state == db::PieceState::kReserved) open.pieces.push_back(std::move(piece));
  if (open.pieces.empty()) return Error{ErrorCode::kConflict, nothing_to_cut(*record)};
  std::stable_sort(open.pieces.begin(), open.pieces.end(),
                   [](const auto& a, const auto& b) { return a.panel->value < b.panel->value; });
  return open;
}

Status check_cuts_stock(const RunnerOptions& options, const LaserLimits& limits) {
  if (!options.stock_refusal.empty()) return Error{ErrorCode::kRefused, options.stock_refusal};
  if (!limits.finds_home)
    return Error{ErrorCode::kRefused,
                 "the laser does not find its corner by itself, so nothing says where the panel lies for it: fit "
                 "homing switches and switch homing on ($22=1)"};
  if (!limits.burns)
    return Error{ErrorCode::kRefused,
                 "the laser is a file that records its bytes, so wood would be booked as cut that is whole: put the "
                 "laser's own port into the configuration"};
  return Ok();
}

}  // namespace veneer::daemon
