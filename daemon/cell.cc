#include "daemon/cell.h"

#include <fmt/format.h>
#include <malloc.h>

#include <nlohmann/json.hpp>

#include "daemon/recovery.h"
#include "daemon/store/backup.h"
#include "daemon/unit/disk_room.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {

using nlohmann::json;

namespace {

// Sketches beyond the one that is being drawn; each page asks for one at a time.
constexpr std::size_t kSketchesWaiting = 2;

RunnerOptions runner_options(const Config& config) {
  RunnerOptions options;
  options.confirm = config.before_motion.confirm;
  if (config.before_motion.focus && !config.laser.focus_z)
    options.confirm.push_back(fmt::format("focus at {:.1f} mm", config.panel.thickness.count()));
  for (const auto& zone : config.keep_out) options.keep_out.push_back({zone.name, zone.area});
  options.thickness = config.panel.thickness;
  options.frame_speed = config.framing.speed;
  options.frame_max_power = config.framing.max_power;
  options.stock_refusal = stock_refusal(config);
  options.look_every = config.camera.look_every;
  return options;
}

constexpr std::chrono::seconds kLookAtPictures(5);
constexpr std::chrono::minutes kLookAtStore(1);
static_assert(DiskRoom::kBelieved > 2 * kLookAtStore);  // one look that comes late makes it forget nothing

}  // namespace

WorkerProcessOptions worker_process_options(const Config& config) {
  const std::uint64_t memory = static_cast<std::uint64_t>(config.workers.memory_mb) << 20;
  return {worker_program(), memory == 0 ? usual_worker_memory() : memory, {}};
}

Cell::Cell(boost::asio::io_context& io, const Config& configuration, Devices parts, const Clock& real_clock,
           Logger logger)
    : reactor(io),
      config(configuration),
      log(std::move(logger)),
      hub({}, log),
      tasks(io, real_clock, make_reactor_timer(io),
            [this](const TaskView& task) {
              // Its row in the audit log is written before that of an alarm which the same end begins. Clients hear of
              // the end after that.
              if (task_audit_) task_audit_->changed(task);
              if (news) news->changed(task);
              if (task.state != TaskState::kRunning) metrics.task_ended(task.kind, to_string(task.state));
              if (runner && task.state != TaskState::kRunning) refresh_counts();
            }),
      devices(std::move(parts)),
      panel_library(config.store.data_dir),
      stock_memory(config.store.data_dir / "stock-memory.json"),
      keeper_(std::make_unique<Worker>("keeper", 10)),
      disk_(io, *keeper_, config.store.data_dir, real_clock),
      look_timer_(io) {}

Result<std::unique_ptr<Cell>> Cell::open(boost::asio::io_context& reactor, const Config& config, Devices devices,
                                         const Clock& real_clock, Logger log) {
  auto cell = std::unique_ptr<Cell>(new Cell(reactor, config, std::move(devices), real_clock, std::move(log)));
  auto database = DatabaseThread::open_unchecked(config.store.data_dir / "veneerd.db", reactor);
  if (!database) return database.error();
  cell->database = std::move(*database);
  cell->audit_log_ = std::make_unique<AuditLog>(*cell->database, cell->log);
  cell->task_audit_ = std::make_unique<TaskAudit>(cell->tasks, *cell->audit_log_);
  auto camera = std::make_unique<NotedCamera>(std::move(cell->devices.camera));
  auto scanner = std::make_unique<NotedScanner>(std::move(cell->devices.scanner));
  const NotedCamera* const noted_camera = camera.get();
  const NotedScanner* const noted_scanner = scanner.get();
  cell->devices.camera = std::move(camera), cell->devices.scanner = std::move(scanner);
  const CellDevices named = cell_devices(*cell->devices.scanner, *cell->devices.camera, config);
  cell->database->set_devices(named);

  Cell& c = *cell;
  c.integrity = std::make_unique<DatabaseCheck>(reactor, *c.database, config.store.data_dir / "veneerd.db",
                                                [&c] { c.broadcast_status(); });
  c.database->on_doubt([&c](const std::string& why) {
    c.log->error("{}", why);
    c.integrity->is_due(c.tasks);
  });
  c.backup_disk = std::make_unique<BackupDisk>(backup_dir_of(config.store), real_clock);
  c.backups = std::make_unique<BackupService>(
      reactor, BackupPlace{config.store.data_dir, backup_dir_of(config.store), config.store.keep_backups}, c.log,
      [&c] { c.integrity->is_due(c.tasks); });
  c.scanner_worker = std::make_unique<Worker>("scanner");
  c.camera_worker = std::make_unique<Worker>("camera");
  c.planner_worker = std::make_unique<Worker>("planner", 10);
  for (auto& [pool, options] : {std::pair(&c.queries, QueryPool::Options{"queries", 2, 3}),
                                std::pair(&c.pictures, QueryPool::Options{"pictures", 1, 5}),
                                std::pair(&c.sketches, QueryPool::Options{"sketches", 1, 5, kSketchesWaiting}),
                                std::pair(&c.backup_lists, QueryPool::Options{"backups", 1, 5})}) {
    QueryPool::Options on_these_devices = options;
    on_these_devices.devices = named;
    auto opened = QueryPool::open(config.store.data_dir / "veneerd.db", std::move(on_these_devices));
    if (!opened) return opened.error();
    *pool = std::move(*opened);
  }
  c.counter_ = std::make_unique<CellCounter>(
      *c.database, reactor, [&c](CellCounts counted) { c.take_counts(std::move(counted)); }, c.log);
  c.remnant_clerk =
      std::make_unique<RemnantClerk>(*c.database, c.panel_library, c.remnants, c.panel_figures, c.stock_memory, c.log);
  remove_left_work(config.store.data_dir);
  if (config.devices.choose)
    if (const Status made = make_camera_folder(config.store.data_dir); !made) c.log->warn("{}", made.error().message);
  c.work_runner = std::make_unique<WorkerProcesses>(worker_process_options(config), c.log);
  c.proposals = std::make_unique<ScanProposals>(*c.database, c.panel_library, c.log);
  c.scans = std::make_unique<ScanService>(*c.devices.scanner, *c.database, c.panel_library, *c.work_runner,
                                          *c.proposals, c.config);
  c.bed_pictures = std::make_unique<BedPictures>(*c.devices.camera, config.store.data_dir / kBedPictureName);
  c.calibrations = std::make_unique<CalibrationService>(*c.devices.scanner, *c.bed_pictures, *c.database,
                                                        *c.work_runner, c.config, c.log);
  c.plans = std::make_unique<PlanService>(*c.database, c.panel_library, *c.work_runner, c.config, c.log);
  c.bed = std::make_unique<BedWatcher>(reactor, *c.bed_pictures, *c.camera_worker, *c.work_runner, *c.database,
                                       c.config, [&c] {
                                         c.hub.broadcast({{"type", "bed"}});
                                       });
  c.cuts = std::make_unique<CutPlanner>(reactor, *c.camera_worker, *c.work_runner, *c.database, c.config, c.log);
  c.runner = std::make_unique<JobRunner>(
      reactor, UnitParts{*c.devices.laser, *c.database, *c.bed, *c.cuts, [&c] { return c.may_book(); }},
      runner_options(config), c.log, [&c] {
        if (c.runner) c.metrics.follow(c.runner->view(), c.devices.laser->status().connected);
        if (c.news) c.news->unit_changed();
        c.follow_laser();
        c.follow_state();
        c.broadcast_status();
      });
  c.glances =
      std::make_unique<BedGlances>(BedGlances::Parts{reactor, *c.devices.camera, *c.camera_worker, *c.work_runner,
                                                     c.config, real_clock, make_reactor_timer(reactor)},
                                   [&c] { return c.runner->may_be_watched(); });
  c.cell_status = std::make_unique<CellStatus>(
      CellStatus::Parts{c.config, *c.runner, c.runner->options(), *c.devices.laser, *noted_camera, *noted_scanner,
                        c.devices.hands.has_value(), *c.bed_pictures, c.counts, *c.integrity, *c.backup_disk, c.disk_,
                        [&c] { return c.calibrations->collected().view_heights; }, [&c] { return c.scans->open(); },
                        [&c] { return c.scans->kept(); }, c.alarms, c.tasks, c.guarded});
  c.news = std::make_unique<CellNews>(
      CellNews::Parts{c.config, *c.runner, *c.devices.laser, *c.cell_status, c.hub, c.tasks, c.alarms, *c.audit_log_,
                      *c.work_runner, c.metrics, *c.keeper_, real_clock},
      [&c] { c.broadcast_status(); }, c.log);
  c.news->go_on_from_before();
  c.change_audit = std::make_unique<ChangeAudit>(
      ChangeAudit::Parts{reactor, *c.database, *c.audit_log_, *c.task_audit_},
      [&c](std::int64_t task, const Caller& by) { c.news->began(task, by); }, c.log);
  c.lease_clerk = std::make_unique<LeaseClerk>(
      *c.database,
      [&c](const PanelId& panel) {
        c.hub.broadcast({{"type", "panel"}, {"panel", panel.value}});
      },
      c.log);
  if (c.database->needs_check()) {
    c.log->warn("the database was not closed in order and is checked before anything begins");
    c.integrity->after_unclean_end([&c](const DatabaseCheck::Done& done) {
      c.database->async(recover, [&c, done](const Result<Recovered>& recovered) {
        if (recovered) log_recovered(*recovered, c.log), c.runner->begin(recovered->found);
        c.lease_clerk->changed({});
        c.refresh_counts();
        done(recovered ? Ok() : Status(recovered.error()));
      });
    });
  } else {
    const auto recovered = c.database->call(recover);
    if (!recovered) return recovered.error();
    log_recovered(*recovered, c.log);
    c.runner->begin(recovered->found);
    c.lease_clerk->changed({});
  }
  c.cell_status->look_for_lost_choice(*c.database);
  c.refresh_counts();
  c.look_at_store();
  c.look_regularly();
  return cell;
}

Cell::~Cell() {
  if (integrity) integrity->cancel();
  // Work that is still going on ends first; what it posts to the reactor is never run.
  for (const auto* task : tasks.running()) static_cast<void>(tasks.cancel(task->id));
  if (news) news->end();
  if (bed) bed->stop();
  if (cuts) cuts->stop();
  // Longer than systemd waits, a camera that hangs would keep this process, and with it the laser's port.
  if (devices.camera) devices.camera->give_up();
  scanner_worker.reset();
  planner_worker.reset();
  queries.reset();
  pictures.reset();
  sketches.reset();
  counter_.reset();
  remnant_clerk.reset();
  camera_worker.reset();
  // What tells of the unit ends before it, each before what it was given.
  lease_clerk.reset();
  change_audit.reset();
  news.reset();
  cell_status.reset();
  runner.reset();
}

// Who made room need not wait for the next look.
Status Cell::may_book() {
  Status may = check_room(disk_.free_bytes());
  if (!may) look_at_store();
  return may;
}

void Cell::look_at_store() {
  store_looked_at_ = std::chrono::steady_clock::now();
  backup_disk->look();
  disk_.look();
}

void Cell::refresh_counts() { counter_->count(); }

void Cell::count_stock() {
  if (remnant_clerk) remnant_clerk->look();
}

void Cell::take_counts(CellCounts counted) {
  counts = std::move(counted);
  count_stock();
  broadcast_status();
}

void Cell::look_regularly() {
  look_timer_.expires_after(std::chrono::milliseconds(500));
  look_timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (cancelled) return;
    news->look_for_untold();
    runner->look_again();
    if (counter_->has_failed()) refresh_counts();
    news->look();
    lease_clerk->end_due();
    give_up_kept_scan();
    if (std::chrono::steady_clock::now() - pictures_looked_at_ > kLookAtPictures) give_up_pictures();
    if (std::chrono::steady_clock::now() - store_looked_at_ > kLookAtStore) look_at_store();
    look_regularly();
  });
}

// On the keeper: whoever is asked for a picture holds locks, and what is given up is megabytes. The lock of the C
// library's memory is held meanwhile by a thread of low priority, and the loop that reads STOP would wait for it: so
// only while nothing moves, and at once or not at all.
bool Cell::give_up_pictures() {
  pictures_looked_at_ = std::chrono::steady_clock::now();
  if (!runner->nothing_moves()) return false;
  return keeper_->try_post_giving_way([this, since = pictures_looked_at_ - pictures_kept](const std::stop_token&) {
    const bool had_pictures = panel_library.forget_unasked(since);
    // glibc keeps what was freed, tens of megabytes after pictures, and gives it back to nobody by itself.
    if (had_pictures) malloc_trim(0);
  });
}

void Cell::give_up_kept_scan() {
  const auto kept = scans->kept();
  if (!kept || kept->since == given_up_) return;
  // It is hundreds of megabytes a tile, and the next scan has to find room beside it.
  const bool has_room = disk_.free_bytes().value_or(kLittleRoom) >= kLittleRoom;
  if (!kept->is_over(utc_timestamp(-std::chrono::hours(24)), has_room)) return;
  given_up_ = kept->since;
  log->info("the {} tiles of the series that was refused at {} are kept no longer", kept->tiles, kept->since);
  scanner_worker->post([this] { scans->give_up_kept(); });
}

// What waits to be cut is another thing after a run.
void Cell::follow_state() {
  if (!runner || runner->view().state == counted_in_) return;
  counted_in_ = runner->view().state;
  refresh_counts();
}

// Another laser makes certificates void; the runner has told the database of it before.
void Cell::follow_laser() {
  if (!runner || runner->limits().identity == laser_identity_) return;
  laser_identity_ = runner->limits().identity;
  refresh_counts();
}

void Cell::broadcast_status() {
  if (!runner || !cell_status || hub.clients() == 0) return;
  hub.broadcast_passing(json{{"type", "status"}, {"status", cell_status->tell(Role::kOperator)}},
                        json{{"type", "status"}, {"status", cell_status->tell(Role::kViewer)}});
}

}  // namespace veneer::daemon
