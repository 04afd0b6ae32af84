// From pieces and a pose to strokes: how a panel is laid on the bed, and what the laser is to burn on it.
//
// The work runs on a thread of its own, which has the beam's way found by a worker process; replies come on the
// reactor. Bound to the reactor, except toolpath() and stop(), which are thread-safe.
#pragma once

#include <boost/asio/io_context.hpp>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>

#include "base/log.h"
#include "daemon/config.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "daemon/threads/worker.h"
#include "daemon/unit/run_planner.h"
#include "daemon/workers/work_runner.h"

namespace veneer::daemon {

class CutPlanner final : public RunPlanner {
 public:
  // All references outlive this.
  CutPlanner(boost::asio::io_context& reactor, Worker& worker, WorkRunner& workers, DatabaseThread& database,
             const Config& config, Logger log);

  void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame> travel,
                   std::function<void(Result<std::vector<RunSetup>>)> reply) override;
  void prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces, const std::optional<LaserMotion>& machine,
               std::function<void(Result<PreparedRun>)> reply) override;

  // The strokes that were drawn last, as JSON for the console: polylines in fractions of the picture's width and
  // height, y down. Empty before the first.
  std::string toolpath() const;

  // Breaks off what a worker process does, for good.
  void stop() { ending_.request_stop(); }

 private:
  Result<std::vector<RunSetup>> plan_setups_now(const std::vector<db::PieceRecord>& pieces,
                                                const Box<MachineFrame>& travel);
  Result<PreparedRun> prepare_now(const ProvenPose& pose, const std::vector<db::PieceRecord>& pieces,
                                  const std::optional<LaserMotion>& machine);
  void keep_toolpath(const PanelId& panel, const std::vector<PieceBurn>& burns, nlohmann::json pieces,
                     const BedCalibration& bed, Millimetres thickness);

  boost::asio::io_context& reactor_;
  Worker& worker_;
  WorkRunner& workers_;
  DatabaseThread& database_;
  const Config& config_;
  Logger log_;
  std::stop_source ending_;
  mutable std::mutex mutex_;
  std::string toolpath_;  // guarded by mutex_
};

}  // namespace veneer::daemon
