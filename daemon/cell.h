// The whole cell, wired: devices, workers, database, services, the unit's state machine, what people are told. What the
// API's routes act on. Beside the wiring it looks regularly whether something is due, says whether the data's disk has
// room for a run, and has tiles given up that were kept too long.
//
// Bound to the reactor, except where a service says otherwise. Its devices are made by wiring.cc.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/api/event_hub.h"
#include "daemon/api/router.h"
#include "daemon/api/tasks.h"
#include "daemon/calibration/calibration_service.h"
#include "daemon/config.h"
#include "daemon/devices/bed_glances.h"
#include "daemon/devices/bed_watcher.h"
#include "daemon/devices/camera_trial.h"
#include "daemon/devices/found_devices.h"
#include "daemon/devices/noted_devices.h"
#include "daemon/devices/sim_hands.h"
#include "daemon/news/alarm_book.h"
#include "daemon/news/cell_counts.h"
#include "daemon/news/cell_news.h"
#include "daemon/news/cell_status.h"
#include "daemon/news/change_audit.h"
#include "daemon/news/metrics.h"
#include "daemon/news/task_audit.h"
#include "daemon/plans/cut_planner.h"
#include "daemon/plans/lease_clerk.h"
#include "daemon/plans/plan_service.h"
#include "daemon/records/backup_disk.h"
#include "daemon/records/backup_service.h"
#include "daemon/records/database_check.h"
#include "daemon/records/query_pool.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/remnant_clerk.h"
#include "daemon/stock/remnants.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/audit_log.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/disk_watch.h"
#include "daemon/unit/job_runner.h"
#include "daemon/workers/work_runner.h"
#include "daemon/workers/worker_processes.h"
#include "drivers/camera_driver.h"
#include "drivers/laser_driver.h"
#include "drivers/scanner_driver.h"

namespace veneer::daemon {

struct Devices {
  std::unique_ptr<ScannerDriver> scanner;
  std::unique_ptr<CameraDriver> camera;
  std::unique_ptr<LaserDriver> laser;
  std::optional<SimHands> hands;  // of a cell that is simulated in all of them
};

// How this cell has work done outside its process.
WorkerProcessOptions worker_process_options(const Config& config);

class Cell {
 public:
  // Opens the database and recovers what a crash left behind; where the database must be checked first, both happen
  // while the reactor runs (database_check.h). Nothing moves.
  static Result<std::unique_ptr<Cell>> open(boost::asio::io_context& reactor, const Config& config, Devices devices,
                                            const Clock& real_clock, Logger log);
  ~Cell();
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;

  nlohmann::json status(Role told) const { return cell_status->tell(told); }
  void broadcast_status();

  boost::asio::io_context& reactor;
  const Config config;
  Logger log;
  EventHub hub;
  TaskRegistry tasks;
  AlarmBook alarms;
  Metrics metrics;
  std::function<std::size_t()> connections;  // of the API, once there is a server
  std::function<Status()> guarded;           // whether a guardian watches, or why not; empty: there is nobody to ask
  // To be set before the routes are bound.
  std::function<void()> restart;  // ends the daemon in order; empty: nobody would start it again
  DeviceRoots device_roots;
  CameraTrials camera_trials;
  Devices devices;
  PanelLibrary panel_library;
  std::chrono::steady_clock::duration pictures_kept = std::chrono::minutes(1);  // in memory, since somebody asked last
  // Gives up what was kept longer, now; the cell's timer does so as well. False: it has to wait, since something moves
  // or the keeper has other things to do.
  bool give_up_pictures();
  std::unique_ptr<WorkRunner> work_runner;  // where foreign data is looked at
  // Declared before the database, which is closed in order although these wait for the backups' disk.
  std::unique_ptr<BackupDisk> backup_disk;
  std::unique_ptr<BackupService> backups;
  std::unique_ptr<QueryPool> backup_lists;   // nothing else is asked there
  std::unique_ptr<DatabaseThread> database;  // writes, and what the unit and the services read
  std::unique_ptr<DatabaseCheck> integrity;
  StockMemory stock_memory;
  PanelFigures panel_figures{panel_library, stock_memory};
  Remnants remnants{panel_library, stock_memory};
  std::unique_ptr<ScanProposals> proposals;
  std::unique_ptr<ScanService> scans;
  std::unique_ptr<BedPictures> bed_pictures;
  std::unique_ptr<CalibrationService> calibrations;
  std::unique_ptr<PlanService> plans;
  std::unique_ptr<BedWatcher> bed;
  std::unique_ptr<BedGlances> glances;
  std::unique_ptr<CutPlanner> cuts;

 private:
  // They outlive the unit and what tells of it.
  std::unique_ptr<Worker> keeper_;  // of small files, and of the data's disk
  DiskWatch disk_;
  std::unique_ptr<AuditLog> audit_log_;
  std::unique_ptr<TaskAudit> task_audit_;

 public:
  std::unique_ptr<JobRunner> runner;
  // Counted for the status without asking the database each time; refreshed by refresh_counts().
  CellCounts counts;
  void refresh_counts();
  bool is_counting() const { return counter_->is_counting(); }
  // What lists and searches tell of panels that nobody counted yet, soon and behind all else. From any thread, as long
  // as something may be asked.
  void count_stock();
  std::unique_ptr<CellStatus> cell_status;
  std::unique_ptr<CellNews> news;
  std::unique_ptr<ChangeAudit> change_audit;
  std::unique_ptr<LeaseClerk> lease_clerk;

  // Last, so that they finish their work before what it uses is gone.
  std::unique_ptr<Worker> scanner_worker, camera_worker, planner_worker;
  std::unique_ptr<QueryPool> queries, pictures, sketches;  // what clients ask; pictures take longer
  std::unique_ptr<RemnantClerk> remnant_clerk;

 private:
  Cell(boost::asio::io_context& reactor, const Config& config, Devices devices, const Clock& real_clock, Logger log);
  void look_regularly();
  void give_up_kept_scan();
  void follow_laser();
  void follow_state();
  void look_at_store();
  Status may_book();  // what a run cuts, as far as the data's disk has said
  void take_counts(CellCounts counted);

  std::unique_ptr<CellCounter> counter_;
  std::chrono::steady_clock::time_point store_looked_at_;     // when the last look at the data's disk was begun
  std::chrono::steady_clock::time_point pictures_looked_at_;  // the same, of pictures in memory
  std::string laser_identity_;
  CellState counted_in_ = CellState::kStopped;  // the unit's state when the counts were refreshed last
  std::string given_up_;                        // since when the series was kept that is given up
  boost::asio::steady_timer look_timer_;
};

}  // namespace veneer::daemon
