// Looks at the bed: which panel lies there, how, and what that means for the beam.
//
// The camera and all fitting run on the camera's worker; replies come on the reactor. Bound to the reactor, except
// picture() and toolpath(), which are thread-safe.
#pragma once

#include <boost/asio/io_context.hpp>
#include <mutex>
#include <string>

#include "base/log.h"
#include "daemon/calibration.h"
#include "daemon/config.h"
#include "daemon/database_thread.h"
#include "daemon/job_runner.h"
#include "daemon/worker.h"
#include "drivers/camera_driver.h"

namespace veneer::daemon {

class BedWatcher final : public RunSupport {
 public:
  // `on_picture` is called on the reactor when picture() has changed. All references outlive this.
  BedWatcher(boost::asio::io_context& reactor, CameraDriver& camera, Worker& camera_worker, DatabaseThread& database,
             const Config& config, Logger log, std::function<void()> on_picture);

  void look(std::function<void(Result<ProvenPose>)> reply) override;
  void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame> travel,
                   std::function<void(Result<std::vector<RunSetup>>)> reply) override;
  void prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces, const std::optional<LaserMotion>& machine,
               std::function<void(Result<std::vector<PieceBurn>>)> reply) override;

  // The last look as JPEG, with what was found drawn in; empty before the first.
  std::string picture() const;
  // The strokes that were drawn last, as JSON for the console: polylines in fractions of the picture's width and
  // height, y down. Thread-safe; empty before the first.
  std::string toolpath() const;

 private:
  Result<std::vector<RunSetup>> plan_setups_now(const std::vector<db::PieceRecord>& pieces,
                                                const Box<MachineFrame>& travel);
  void keep_toolpath(const PanelId& panel, const std::vector<PieceBurn>& burns, nlohmann::json pieces,
                     const BedCalibration& bed);
  Result<ProvenPose> look_now();
  Result<std::vector<PieceBurn>> prepare_now(const ProvenPose& pose, const std::vector<db::PieceRecord>& pieces,
                                             const std::optional<LaserMotion>& machine);

  boost::asio::io_context& reactor_;
  CameraDriver& camera_;
  Worker& worker_;
  DatabaseThread& database_;
  const Config& config_;
  Logger log_;
  std::function<void()> on_picture_;
  mutable std::mutex picture_mutex_;
  std::string picture_;   // guarded by picture_mutex_
  std::string toolpath_;  // guarded by picture_mutex_
};

}  // namespace veneer::daemon
