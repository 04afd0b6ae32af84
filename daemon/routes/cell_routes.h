// The API's operations, group by group, each with the services it needs and no others. The handlers run on the reactor
// and hand slow work to the workers and the pools.
//
// What a group's services refer to outlives the router. Their on_...() may be called from any thread.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/log.h"
#include "daemon/api/router.h"
#include "daemon/api/tasks.h"
#include "daemon/calibration/calibration_service.h"
#include "daemon/config.h"
#include "daemon/devices/bed_glances.h"
#include "daemon/devices/bed_watcher.h"
#include "daemon/devices/camera_trial.h"
#include "daemon/devices/found_devices.h"
#include "daemon/devices/sim_hands.h"
#include "daemon/news/alarm_book.h"
#include "daemon/news/metrics.h"
#include "daemon/plans/cut_planner.h"
#include "daemon/plans/plan_service.h"
#include "daemon/records/backup_disk.h"
#include "daemon/records/backup_service.h"
#include "daemon/records/database_check.h"
#include "daemon/records/query_pool.h"
#include "daemon/routes/pattern_word.h"
#include "daemon/stock/panel_figures.h"
#include "daemon/stock/panel_library.h"
#include "daemon/stock/remnants.h"
#include "daemon/stock/scan_proposals.h"
#include "daemon/stock/scan_service.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/cell_commands.h"
#include "daemon/unit/job_commands.h"
#include "daemon/unit/jog_commands.h"
#include "daemon/unit/override_commands.h"
#include "daemon/unit/pattern_commands.h"
#include "daemon/unit/unit_state.h"
#include "daemon/workers/work_runner.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// Status, commands, the bed's picture, the check of the database.
struct UnitServices {
  const UnitState& unit;
  CellCommands& commands;
  Metrics& metrics;
  BedWatcher& bed;
  BedGlances& glances;
  CutPlanner& cuts;
  DatabaseCheck& integrity;
  TaskRegistry& tasks;
  QueryPool& queries;
  std::function<nlohmann::json(Role told)> status;
};
void bind_unit_routes(Router& router, const UnitServices& services);
// STOP: the reset byte goes out before anybody asks who wants it, and before the reply is made.
ApiReply stop_at_once(CellCommands& commands, const UnitState& unit, Metrics& metrics, const WhoAsks& who_asks);

// What is only drawn of what is kept.
struct PictureServices {
  QueryPool& pictures;
  const PanelLibrary& panel_library;
};
// A panel's map in tiles, for whoever looks closely.
void bind_tile_routes(Router& router, const PictureServices& services);
// One piece of a plan: its other places, and pictures of its wood.
void bind_plan_piece_routes(Router& router, const PictureServices& services);
// Maps for putting pieces together.
void bind_map_routes(Router& router, const PictureServices& services);
// Tags and grids to print.
void bind_fiducial_routes(Router& router, QueryPool& pictures);

// Told, from any thread, that this panel has changed, or, of none, that stock has.
using PanelChanged = std::function<void(const std::optional<PanelId>& panel)>;

// Panels.
struct StockServices {
  QueryPool& queries;
  DatabaseThread& database;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
  StockMemory& memory;
  PanelFigures& figures;
  Remnants& remnants;
  PanelChanged on_changed;
};
void bind_stock_routes(Router& router, const StockServices& services);

// Scans, and what they propose until somebody accepts it.
struct ProposalServices {
  ScanService& scans;
  ScanProposals& proposals;
  Worker& scanner;
  TaskRegistry& tasks;
  QueryPool& queries;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
  PanelChanged on_changed;
};
void bind_proposal_routes(Router& router, const ProposalServices& services);

// Versions of a panel's mask, and what people painted on it.
struct MaskServices {
  QueryPool& queries;
  DatabaseThread& database;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
  PanelChanged on_changed;
};
void bind_mask_routes(Router& router, const MaskServices& services);

// Which panels there are, and which of them have the wood that somebody looks for; what is left of one, as a picture
// and as a label.
struct RemnantServices {
  QueryPool& queries;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
  StockMemory& memory;
  PanelFigures& figures;
  Remnants& remnants;
  std::function<void()> count_soon;  // what nobody counted yet, behind all else; from any thread
};
void bind_remnant_routes(Router& router, const RemnantServices& services);

// Which scanners there are to be configured.
struct ScannerServices {
  WorkRunner& workers;
  const Config& config;
  Worker& scanner;
  TaskRegistry& tasks;
};
void bind_scanner_routes(Router& router, const ScannerServices& services);

// null: by nothing that lasts.
nlohmann::json to_json(NamedBy named_by);

// A camera's, by name.
nlohmann::json settings_json(const std::vector<std::pair<std::string, std::string>>& settings);
// The same of cameras.
struct CameraServices {
  const UnitState& unit;
  WorkRunner& workers;
  const Config& config;
  DeviceRoots roots;
  Worker& camera;
  TaskRegistry& tasks;
  QueryPool& pictures;  // where pictures are handed out
  CameraTrials& trials;
};
void bind_camera_routes(Router& router, const CameraServices& services);

struct CalibrationServices {
  CalibrationService& calibrations;
  const UnitState& unit;
  PatternCommands& patterns;
  Worker& scanner;
  Worker& camera;
  TaskRegistry& tasks;
  QueryPool& queries;
  Millimetres thickness;  // of a panel
  std::function<void()> on_calibrated;
  std::function<void(std::function<void()>)> on_reactor;  // has something done there
};
void bind_calibration_routes(Router& router, const CalibrationServices& services);
// A run looks at the bed with the same camera and on the same thread, so that a calibration which takes its time, or
// hangs, would hold the run: kConflict then. What was asked for before a job was started is done before its first look.
Status camera_is_free(const UnitState& unit);

// The first day: devices, the bed as the camera sees it, and a simulated cell's hands.
struct SetupServices {
  CalibrationService& calibrations;
  const UnitState& unit;
  BedWatcher& bed;
  Worker& camera;
  TaskRegistry& tasks;
  QueryPool& pictures;  // where hands take their time
  const Config& config;
  const SimHands* hands;  // nullptr: people have their own
  CellDevices named;
};
void bind_setup_routes(Router& router, const SetupServices& services);

// Which devices there are, and choosing them for the next start.
struct DeviceServices {
  const UnitState& unit;
  DatabaseCheck& integrity;
  TaskRegistry& tasks;
  QueryPool& pictures;  // where the disk is waited for
  const Config& config;
  DeviceRoots roots;
  const CameraTrials& trials;
  std::function<void(std::function<void()>)> on_reactor;
  // What is about to be done; it is written when this returns. Never on the reactor.
  std::function<Status(const std::string& who, const std::string& what, const std::string& detail)> audit;
  std::function<void()> restart;  // ends the daemon in order for whoever starts it again; empty: nobody does
};
void bind_device_routes(Router& router, const DeviceServices& services);

struct MetricsServices {
  Metrics& metrics;
  std::function<Metrics::Now()> now;
};
void bind_metrics_routes(Router& router, const MetricsServices& services);

// What needs somebody, and who has seen it.
struct AlarmServices {
  AlarmBook& book;
  const Config& config;
  std::function<void()> on_changed;
  std::function<Result<std::int64_t>()> try_notices;  // the task that sends one
};
void bind_alarm_routes(Router& router, const AlarmServices& services);

// Told, from any thread, that leases were made or ended: what is free of these panels may be more or less.
using LeasesChanged = std::function<void(const std::vector<PanelId>& panels)>;

struct JobServices {
  PlanService& plans;
  Worker& planner;
  PlannerConfig planning;
  TaskRegistry& tasks;
  const UnitState& unit;
  JobCommands& commands;
  DatabaseThread& database;
  QueryPool& queries;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
  std::function<void(JobId)> on_job_changed;
  LeasesChanged on_leases_changed;
  const LaserConfig& laser;  // whose port viewers are not told
};
void bind_job_routes(Router& router, const JobServices& services);

// Plans that no wood is reserved for: make, look, change, compare, lease their wood.
struct PlanServices {
  PlanService& plans;
  Worker& planner;
  PlannerConfig planning;
  TaskRegistry& tasks;
  DatabaseThread& database;
  QueryPool& queries;
  QueryPool& pictures;
  QueryPool& sketches;  // one at a time, beside the planner
  const PanelLibrary& panel_library;
  LeasesChanged on_leases_changed;
};
void bind_plan_routes(Router& router, const PlanServices& services);

// What a piece tells of its life, and what was made of a place.
struct PieceServices {
  QueryPool& queries;
  QueryPool& pictures;
  const PanelLibrary& panel_library;
};
void bind_piece_routes(Router& router, const PieceServices& services);

// Test pattern, drawings, jog, overrides.
struct LaserServices {
  const UnitState& unit;
  PatternCommands& patterns;
  JogCommands& jogging;
  OverrideCommands& overrides;
  TaskRegistry& tasks;
  const RecipeConfig& recipe;
  QueryPool& pictures;  // large drawings are read there
  std::function<void(std::function<void()>)> on_reactor;
};
void bind_laser_routes(Router& router, const LaserServices& services);

// A drawing's lines, before they are burnt.
struct DrawingServices {
  const UnitState& unit;
  const RecipeConfig& recipe;
  QueryPool& sketches;  // one at a time
  WorkRunner& workers;
  std::filesystem::path data_dir;
};
void bind_drawing_routes(Router& router, const DrawingServices& services);

// Backups.
struct StoreServices {
  BackupService& backups;
  const BackupDisk& disk;
  TaskRegistry& tasks;
  QueryPool& lists;  // which wait for that disk, and nothing else there
};
void bind_store_routes(Router& router, const StoreServices& services);

// What was done and by whom: the audit log, and what became of every piece.
// `laser` outlives the router: viewers are not told its port.
void bind_history_routes(Router& router, QueryPool& queries, const LaserConfig& laser);
// What people know of woods and panels.
struct FactServices {
  DatabaseThread& database;
  QueryPool& queries;
  PanelChanged on_changed;
};
void bind_fact_routes(Router& router, const FactServices& services);

// Recipes, the wood of zones, test cards, cut files.
struct RecipeServices {
  const UnitState& unit;
  PatternCommands& patterns;
  TaskRegistry& tasks;
  DatabaseThread& database;
  QueryPool& queries;
  QueryPool& pictures;    // of test cards
  QueryPool& by_workers;  // whose answers worker processes give
  WorkRunner& workers;
  const Config& config;
  Logger log;
  std::function<void(const PanelId& panel)> on_panel_changed;
};
void bind_recipe_routes(Router& router, const RecipeServices& services);

}  // namespace veneer::daemon
