// The cell calibrates itself from pictures and burns: each function looks at what the operator laid down, fits, and
// issues a certificate, or says in one sentence why not.
//
// Threading: blocking; scanner() and kerf() on the scanner's worker, camera() and axes() on the camera's. pattern() is
// pure.
#pragma once

#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "calib/camera_fit.h"
#include "calib/camera_model.h"
#include "calib/scanner_model.h"
#include "daemon/config.h"
#include "daemon/database_thread.h"
#include "daemon/scan_service.h"
#include "drivers/camera_driver.h"
#include "drivers/laser_job.h"
#include "drivers/scanner_driver.h"
#include "planner/pattern.h"

namespace veneer::daemon {

struct CalibrationOutcome {
  std::string device;           // "scanner", "camera", "axes", "kerf"
  std::size_t views = 0;        // collected so far
  CertificateId certificate;    // {0} while further views follow
  Millimetres rms{0};           // of the fit
  std::string payload = "{}";   // JSON, as stored
};

class CalibrationService {
 public:
  CalibrationService(ScannerDriver& scanner, CameraDriver& camera, DatabaseThread& database, const Config& config,
                     Logger log);

  // The AprilGrid sheet on the glass; two or three scans at different places cover more of it.
  Result<CalibrationOutcome> scanner(bool more, const TaskProgress& progress, const std::stop_token& stop);
  // The AprilGrid sheet on the bed, its printed face `height` above it; at least four views at two heights.
  Result<CalibrationOutcome> camera(bool more, Millimetres height, const TaskProgress& progress);
  // The burnt pattern on the bed, the board's upper face `height` above it.
  Result<CalibrationOutcome> axes(Millimetres height, const TaskProgress& progress);
  // The burnt board on the glass.
  Result<CalibrationOutcome> kerf(const TaskProgress& progress, const std::stop_token& stop);

  // What the laser burns for axes() and kerf(), 40 mm inside the machine's travel.
  Result<LaserJob> pattern_job(const Box<MachineFrame>& travel) const;

 private:
  Result<planner::Pattern> pattern(const Box<MachineFrame>& travel) const;
  Result<CertificateId> issue(db::CertificateKind kind, Millimetres rms, const std::string& payload);

  ScannerDriver& scanner_;
  CameraDriver& camera_;
  DatabaseThread& database_;
  const Config& config_;
  Logger log_;
  std::vector<calib::GridScan> grid_scans_;  // scanner's worker
  std::vector<calib::GridView> grid_views_;  // camera's worker
  int picture_width_ = 0, picture_height_ = 0;
  // Where the pattern was burnt last; written before the burn, read by axes() and kerf() after it.
  mutable std::mutex travel_mutex_;
  mutable Box<MachineFrame> travel_;
};

}  // namespace veneer::daemon
