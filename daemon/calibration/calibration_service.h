// The cell calibrates itself from pictures and burns: each function looks at what the operator laid down, fits, and
// issues a certificate, or says in one sentence why not. Looking and fitting are done by worker processes
// (daemon/orders/calibration_work.h).
//
// Threading: blocking; scanner() and kerf() on the scanner's worker, camera() and axes() on the camera's. pattern_for()
// and note_burnt() on the reactor.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/result.h"
#include "calib/scanner_model.h"
#include "daemon/calibration/pattern_board.h"
#include "daemon/config.h"
#include "daemon/devices/bed_pictures.h"
#include "daemon/orders/calibration_work.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/calibration.h"
#include "daemon/store/database_thread.h"
#include "daemon/workers/work_runner.h"
#include "drivers/camera_driver.h"
#include "drivers/laser_job.h"
#include "drivers/scanner_driver.h"
#include "planner/cutting/calibration_pattern.h"

namespace veneer::daemon {

struct CalibrationOutcome {
  std::string device;          // "scanner", "camera", "axes", "kerf"
  std::size_t views = 0;       // collected so far
  CertificateId certificate;   // {0} while further views follow
  Millimetres rms{0};          // of the fit
  std::string payload = "{}";  // JSON, as stored
};

// What certificates are bound to: the devices as they name themselves, and what of the configuration changes what they
// measure.
CellDevices cell_devices(const ScannerDriver& scanner, const CameraDriver& camera, const Config& config);

class CalibrationService {
 public:
  // All references outlive this.
  // A camera that writes a file now and then may have none yet of what was just laid or burnt: the next one is waited
  // for, for so long.
  static constexpr std::chrono::milliseconds kUsualPatience{60'000};

  CalibrationService(ScannerDriver& scanner, BedPictures& pictures, DatabaseThread& database, WorkRunner& workers,
                     const Config& config, Logger log, std::chrono::milliseconds patience = kUsualPatience);

  // The AprilGrid sheet on the glass; two or three scans at different places cover more of it.
  Result<CalibrationOutcome> scanner(bool more, const TaskProgress& progress, const std::stop_token& stop);
  // The AprilGrid sheet on the bed, its printed face `height` above it; at least four views at two heights.
  Result<CalibrationOutcome> camera(bool more, Millimetres height, const TaskProgress& progress,
                                    const std::stop_token& stop);
  // Before the pattern is burnt, and before the laser is homed for it (`travel` may be empty then): whether it could be
  // measured afterwards, whether the AprilGrid sheet still lies on the bed, through which it would be cut, and whether
  // the board lies where it will be burnt. kRefused, saying what to do.
  Status ready_for_pattern(const Box<MachineFrame>& travel, const PatternBoard& board, const TaskProgress& progress,
                           const std::stop_token& stop);
  // The burnt pattern on the bed, the board's upper face `height` above it.
  Result<CalibrationOutcome> axes(Millimetres height, const TaskProgress& progress, const std::stop_token& stop);
  // The burnt board on the glass.
  Result<CalibrationOutcome> kerf(const TaskProgress& progress, const std::stop_token& stop);

  // What is collected and not fitted yet: a guide that was left goes on from it. Thread-safe.
  struct Collected {
    std::size_t grid_scans = 0;
    std::vector<Millimetres> view_heights;  // of the camera's views, in the order in which they were taken
  };
  Collected collected() const;

  // What the laser burns for axes() and kerf() into a board that lies in the middle of the bed, within 20 mm and 4
  // degrees. A travel that is not known yet is empty: the strokes are the board's then, and lie anywhere.
  Result<LaserJob> pattern_for(const Box<MachineFrame>& travel, const PatternBoard& board) const;
  // That these strokes are burnt, the last one too: they are what axes() and kerf() measure from now on. Until then it
  // is the pattern that was burnt before. The board's size was told, as for pattern_for().
  void note_burnt(const Box<MachineFrame>& travel, const PatternBoard& board);

 private:
  void note_grid_scans();  // on the scanner's worker
  void note_grid_views();  // on the camera's
  // Of the pattern that was burnt last, in this life of the daemon or as the axes certificate tells; kRefused when
  // none.
  Result<PatternLayout> burnt_pattern(const Calibration& calibration) const;
  Box<MachineFrame> reach() const;
  // Has `request` done, on a picture where it wants one.
  template <class Answer, class Request>
  Result<Answer> have(const Request& request, const std::filesystem::path& picture, const TaskProgress& progress,
                      const std::stop_token& stop);
  Result<BedPictures::Picture> photograph(BedPictures::For what, const std::stop_token& stop);
  Status require_new_view(const BedPictures::Picture& picture) const;
  Result<ScanFile> scan(const char* what, const TaskProgress& progress, const std::stop_token& stop);
  // kRefused when a certificate of this kind was made from a picture with that content already: a device that reads
  // files gives what lay there when somebody wrote them.
  Status require_unused(db::CertificateKind kind, const std::string& content, const std::string& device);
  // Names the device in the payload, and the content of the pictures it was made from; the outcome gets certificate,
  // rms and payload.
  Status issue(db::CertificateKind kind, Millimetres rms, nlohmann::json payload,
               const std::vector<std::string>& pictures, CalibrationOutcome& outcome);

  ScannerDriver& scanner_;
  BedPictures& pictures_;
  DatabaseThread& database_;
  WorkRunner& workers_;
  const Config& config_;
  Logger log_;
  const std::chrono::milliseconds patience_;
  std::vector<calib::GridScan> grid_scans_;      // scanner's worker
  std::vector<std::string> grid_scan_pictures_;  // their content
  std::string grid_make_;                        // of the device that scanned them
  FitCamera grid_views_;                         // camera's worker
  std::vector<std::string> grid_pictures_;       // their content
  mutable std::mutex collected_mutex_;
  Collected collected_;  // guarded by collected_mutex_
  // The pattern that was burnt last; written by the reactor before the burn, read by the workers after it.
  mutable std::mutex burnt_mutex_;
  std::optional<PatternLayout> burnt_;  // guarded by burnt_mutex_
  Box<MachineFrame> reach_;             // guarded by burnt_mutex_; of the laser that burnt it
};

}  // namespace veneer::daemon
