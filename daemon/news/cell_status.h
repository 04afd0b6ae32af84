// How the cell stands, for whoever asks: what it needs and what a person is to do next, which certificates are in
// force, the chain of interlocks, and all of it as the API's status (docs/openapi.json).
//
// Bound to the reactor. Reads memory alone: what the database tells is counted beside it (cell_counts.h).
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/units.h"
#include "daemon/api/api_message.h"
#include "daemon/api/tasks.h"
#include "daemon/config.h"
#include "daemon/devices/bed_pictures.h"
#include "daemon/devices/noted_devices.h"
#include "daemon/news/alarm_book.h"
#include "daemon/news/cell_counts.h"
#include "daemon/news/next_step.h"
#include "daemon/records/backup_disk.h"
#include "daemon/records/database_check.h"
#include "daemon/stock/scan_series.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/disk_watch.h"
#include "daemon/unit/runner_options.h"
#include "daemon/unit/unit_state.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

class CellStatus {
 public:
  // All of it outlives this.
  struct Parts {
    const Config& config;
    const UnitState& unit;
    const RunnerOptions& options;  // of the unit
    const LaserDriver& laser;
    const NotedCamera& camera;
    const NotedScanner& scanner;
    bool has_hands;  // a simulated cell's
    const BedPictures& bed_pictures;
    const CellCounts& counts;
    const DatabaseCheck& integrity;
    const BackupDisk& backups;
    const DiskWatch& disk;
    std::function<std::vector<Millimetres>()> camera_views;  // as CellNeeds has them
    std::function<std::optional<ScanSeries::Open>()> open_scan;
    std::function<std::optional<ScanSeries::Kept>()> kept_scan;
    const AlarmBook& alarms;
    const TaskRegistry& tasks;
    const std::function<Status()>& guarded;  // whether a guardian watches, or why not; empty: there is nobody to ask
    std::function<std::chrono::system_clock::time_point()> now = &std::chrono::system_clock::now;
  };
  explicit CellStatus(Parts parts) : p_(std::move(parts)) {}

  // A viewer is told no ports, no paths, and not why the laser does not answer.
  nlohmann::json tell(Role told) const;
  CellNeeds needs() const;
  NextStep next() const;
  // Whether the database has told yet what needs() say of it.
  bool is_counted() const { return p_.counts.known; }
  // Were devices chosen once, and is the file that says which gone? That is asked of the audit log, once; an answer
  // that comes after this has ended is dropped.
  void look_for_lost_choice(DatabaseThread& database);

 private:
  std::vector<CellNeeds::Certificate> certificates() const;  // as they stand now
  std::vector<std::string> asked_by_name() const;            // before the beam comes on
  nlohmann::json interlocks_json(const LaserStatus& laser, bool tell_why) const;
  void leave_out_places(nlohmann::json& status, const LaserStatus& laser) const;

  const Parts p_;
  bool choice_lost_ = false;
  const std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace veneer::daemon
