// The whole cell, wired: devices, workers, database, services, the unit's state machine. What the API's routes act on.
//
// Bound to the reactor, except where a service says otherwise. Its devices are made by wiring.cc.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

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
#include "daemon/news/interlocks.h"
#include "daemon/news/metrics.h"
#include "daemon/news/next_step.h"
#include "daemon/news/notifier.h"
#include "daemon/news/task_audit.h"
#include "daemon/news/untold_failures.h"
#include "daemon/plans/cut_planner.h"
#include "daemon/plans/plan_service.h"
#include "daemon/records/backup_disk.h"
#include "daemon/records/backup_service.h"
#include "daemon/records/database_check.h"
#include "daemon/records/kept_file.h"
#include "daemon/records/query_pool.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/remnant_clerk.h"
#include "daemon/stock/remnants.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/audit_log.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/disk_room.h"
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

  // A viewer is told no ports, no paths, and not why the laser does not answer.
  nlohmann::json status(Role told) const;
  void broadcast_status();
  // Who changed what, as the router tells it; written before what the change itself writes.
  // Of the reactor or of the pools below, which answer some requests themselves: then it is noted in the reactor's
  // turn.
  void audit(const Router::Change& change);
  // What is about to be done, in words of its own; it is written when this returns. Never on the reactor.
  Status audit_now(const std::string& who, const std::string& what, const std::string& detail) const;
  // kUnavailable while so many changes of this caller wait to be written that a run would have to wait behind them.
  Status may_be_noted(const Caller& caller) const;

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
  std::unique_ptr<JobRunner> runner;
  // Counted for the status without asking the database each time; refreshed by refresh_counts().
  CellCounts counts;
  void refresh_counts();
  bool is_counting() const { return counter_->is_counting(); }
  // What lists and searches tell of panels that nobody counted yet, soon and behind all else. From any thread, as long
  // as something may be asked.
  void count_stock();
  // A notice that says that it is a try, to whoever is told of alarms: the task that sends it.
  Result<std::int64_t> try_notices();
  // Somebody acknowledged some.
  void alarms_changed();
  // Somebody was sent this task, as it stands.
  void task_told(const TaskView& task, const Caller& by) {
    if (untold_.told(task, by.who)) keep_tasks();
  }
  // How long whoever asked for a task may take to look what it was refused for, before that is an alarm.
  std::chrono::milliseconds time_to_look{10'000};
  // A lease was made or ended, and wood of these panels is somebody else's, or nobody's.
  void leases_changed(const std::vector<PanelId>& touched);

  // Last, so that they finish their work before what it uses is gone.
  std::unique_ptr<Worker> scanner_worker, camera_worker, planner_worker;
  std::unique_ptr<QueryPool> queries, pictures, sketches;  // what clients ask; pictures take longer
  std::unique_ptr<RemnantClerk> remnant_clerk;

 private:
  Cell(boost::asio::io_context& reactor, const Config& config, Devices devices, const Clock& real_clock, Logger log);
  void leave_out_places(nlohmann::json& status, const LaserStatus& laser) const;
  void look_regularly();
  void look_for_lost_choice();
  void end_leases();
  void give_up_kept_scan();
  void follow_laser();
  void follow_state();
  std::vector<CellNeeds::Certificate> certificates() const;  // as they stand now
  std::vector<std::string> asked_by_name() const;            // before the beam comes on
  CellNeeds needs() const;
  NextStep next() const;
  nlohmann::json interlocks_json(const LaserStatus& laser, bool tell_why) const;
  void look_at_store();
  Status may_book();  // what a run cuts, as far as the data's disk has said
  void look_for_alarms();
  void tell_of(const TaskView& task);
  void note_failure(const TaskView& task);
  void note_untold(TimePoint before);  // failures that nobody was told of
  void take_end(const TaskView& task);
  bool listens(const std::string& who) const { return hub.is_followed_by(who); }
  void notify(const Notice& notice);
  void look_for_notices();
  void go_on_from_before();  // alarms and tasks, as the daemon before this one left them
  void keep_alarms();
  void keep_task(const TaskView& changed);
  void keep_tasks();

  void take_counts(CellCounts counted);

  UntoldFailures untold_;
  KeptFile kept_alarms_, kept_tasks_;
  std::unique_ptr<Worker> keeper_;  // writes them
  std::int64_t last_kept_ = 0;      // the newest task that is
  bool choice_lost_ = false;
  bool counted_ = false;  // what the database knows of alarms is known here

  const NotedCamera* noted_camera_ = nullptr;  // of devices
  const NotedScanner* noted_scanner_ = nullptr;
  DiskRoom room_;  // on the data's disk
  bool looks_at_store_ = false;
  std::chrono::steady_clock::time_point store_looked_at_;  // when the last look was begun

  std::unique_ptr<CellCounter> counter_;

  const std::thread::id reactor_thread_ = std::this_thread::get_id();
  const std::shared_ptr<int> alive_ = std::make_shared<int>();
  std::unique_ptr<AuditLog> audit_log_;
  std::unique_ptr<TaskAudit> task_audit_;
  std::string laser_identity_;
  std::unique_ptr<Notifier> notifier_;
  CellState noticed_ = CellState::kStopped;     // the unit's state when it was looked whether somebody is to be told
  CellState counted_in_ = CellState::kStopped;  // the unit's state when the counts were refreshed last
  std::string given_up_;                        // since when the series was kept that is given up
  std::string lease_end_;                       // of the lease that ends next; "" when none is known
  boost::asio::steady_timer look_timer_;
};

}  // namespace veneer::daemon
