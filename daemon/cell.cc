#include "daemon/cell.h"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>

#include "base/journal.h"
#include "daemon/devices/device_places.h"
#include "daemon/news/cell_alarms.h"
#include "daemon/store/backup.h"
#include "daemon/unit/disk_room.h"
#include "daemon/unit/job_words.h"
#include "daemon/workers/work_folder.h"

namespace veneer::daemon {

using nlohmann::json;

namespace {

// Of panels that wait for a scan: a status is sent again and again.
constexpr std::size_t kWaitingNamed = 20;

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

json load_json(const LoadView& load, const RunnerOptions& options, double time_scale) {
  return {{"panel", load.panel.value},
          {"face_up", "back"},
          {"found", load.found},
          {"rms_mm", load.found ? json(load.rms.count()) : json()},
          {"sentence", load.sentence},
          {"setup", load.setup.number},
          {"setups", load.setup.of},
          {"how", load.setup.how},
          {"outline", load.setup.outline},
          {"estimate_s", load.seconds > 0 ? json(load.seconds / time_scale) : json()},
          {"focus_mm", options.thickness.count()},
          {"frame_max_power", options.frame_max_power.count()}};
}

constexpr std::chrono::minutes kLookAtStore(1);
static_assert(DiskRoom::kBelieved > 2 * kLookAtStore);  // one look that comes late makes it forget nothing

struct EndedLeases {
  std::vector<std::string> sentences;
  std::vector<PanelId> panels;
};

// On the database's thread.
Result<EndedLeases> expire_leases(Repositories& r) {
  const auto plans = r.leases.expire(utc_timestamp());
  if (!plans) return plans.error();
  EndedLeases out;
  for (const db::PlanId plan : *plans) {
    out.sentences.push_back(fmt::format("the lease of plan {} is over: its wood is free", plan.value));
    const auto record = r.plans.find(plan);
    if (!record) return record.error();
    for (const db::PlannedPanel& panel : record->panels) out.panels.push_back(panel.panel);
  }
  return out;
}

// What a crash left behind, and what to say of it.
struct Recovered {
  db::Recovery found;
  std::vector<std::string> sentences;
  std::vector<std::string> ended_leases;  // the daemon was off when their time came
};

// On the database's thread.
Result<Recovered> recover(Repositories& r) {
  constexpr std::chrono::hours kKeysLife{30 * 24};
  auto recovery = r.jobs.recover(utc_timestamp());
  if (!recovery) return recovery.error();
  if (auto pruned = r.request_keys.prune(utc_timestamp(-std::chrono::seconds(kKeysLife))); !pruned)
    return pruned.error();
  auto leases = expire_leases(r);
  if (!leases) return leases.error();
  Recovered out{std::move(*recovery), {}, std::move(leases->sentences)};
  for (const JobId job : out.found.completed_jobs)
    out.sentences.push_back(fmt::format(
        "job {} was running when this program ended last; every piece was booked by then, and it is complete",
        job.value));
  for (const JobId job : out.found.aborted_jobs)
    out.sentences.push_back(fmt::format(
        "job {0} was running when this program ended last and is aborted; veneerctl job start {0} goes on with it",
        job.value));
  for (const PieceId id : out.found.suspects) {
    const auto piece = r.jobs.find_piece(id);
    if (!piece) return piece.error();
    out.sentences.push_back(fmt::format(
        "piece {0} of job {1} on panel {2} was being cut and is suspect: look at it, then veneerctl job settle {1} {0}",
        piece->mark, piece->job.value, piece->panel.value_or(PanelId{"?"}).value));
  }
  return out;
}

void begin_after(JobRunner& runner, const Recovered& recovered, const Logger& log) {
  for (const std::string& sentence : recovered.sentences) log->warn("{}", sentence);
  for (const std::string& sentence : recovered.ended_leases) log->info("{}", sentence);
  runner.begin(recovered.found);
}

json step_json(const NextStep& next) {
  return {{"step", to_string(next.step)},
          {"sentence", next.sentence},
          {"command", next.command.empty() ? json() : json(next.command)},
          {"job", next.job ? json(*next.job) : json()}};
}

json overrides_json(const LaserOverrides& o) { return {{"feed", o.feed}, {"rapid", o.rapid}, {"power", o.power}}; }

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
              tell_of(task);
              if (task_audit_) task_audit_->changed(task);
              take_end(task);
              keep_task(task);
              if (task.state != TaskState::kRunning) metrics.task_ended(task.kind, to_string(task.state));
              if (runner && task.state != TaskState::kRunning) refresh_counts();
            }),
      devices(std::move(parts)),
      panel_library(config.store.data_dir),
      stock_memory(config.store.data_dir / "stock-memory.json"),
      kept_alarms_(config.store.data_dir / kAlarmsName, log),
      kept_tasks_(config.store.data_dir / kTasksName, log),
      keeper_(std::make_unique<Worker>("keeper", 10)),
      room_(real_clock),
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
  cell->noted_camera_ = camera.get(), cell->noted_scanner_ = scanner.get();
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
  c.remnant_clerk = std::make_unique<RemnantClerk>(*c.database, c.panel_library, c.remnants, c.stock_memory, c.log);
  remove_left_work(config.store.data_dir);
  if (config.devices.choose)
    if (const Status made = make_camera_folder(config.store.data_dir); !made) c.log->warn("{}", made.error().message);
  c.work_runner = std::make_unique<WorkerProcesses>(worker_process_options(config), c.log);
  NotifierOptions notices;
  notices.to = config.notify;
  notices.data_dir = config.store.data_dir;
  c.notifier_ = std::make_unique<Notifier>(std::move(notices), *c.work_runner, c.log,
                                           [&c](const std::string& outcome) { c.metrics.notice_ended(outcome); });
  c.go_on_from_before();
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
        c.follow_laser();
        c.follow_state();
        c.broadcast_status();
      });
  c.glances =
      std::make_unique<BedGlances>(BedGlances::Parts{reactor, *c.devices.camera, *c.camera_worker, *c.work_runner,
                                                     c.config, real_clock, make_reactor_timer(reactor)},
                                   [&c] { return c.runner->may_be_watched(); });
  if (c.database->needs_check()) {
    c.log->warn("the database was not closed in order and is checked before anything begins");
    c.integrity->after_unclean_end([&c](const DatabaseCheck::Done& done) {
      c.database->async(recover, [&c, done](const Result<Recovered>& recovered) {
        if (recovered) begin_after(*c.runner, *recovered, c.log);
        c.leases_changed({});
        c.refresh_counts();
        done(recovered ? Ok() : Status(recovered.error()));
      });
    });
  } else {
    const auto recovered = c.database->call(recover);
    if (!recovered) return recovered.error();
    begin_after(*c.runner, *recovered, c.log);
    c.leases_changed({});
  }
  c.look_for_lost_choice();
  c.refresh_counts();
  c.look_at_store();
  c.look_regularly();
  return cell;
}

Cell::~Cell() {
  if (integrity) integrity->cancel();
  // Work that is still going on ends first; what it posts to the reactor is never run.
  for (const auto* task : tasks.running()) static_cast<void>(tasks.cancel(task->id));
  notifier_.reset();
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
  runner.reset();
  keeper_.reset();
}

void Cell::look_for_lost_choice() {
  const bool open = config.laser.set_by == SetBy::kNobody || config.scanner.set_by == SetBy::kNobody ||
                    config.camera.set_by == SetBy::kNobody;
  if (!open || config.devices.chosen) return;
  database->async([](Repositories& r) { return r.audit.devices_were_chosen(); },
                  [this](const Result<bool>& lost) { choice_lost_ = lost && *lost; });
}

// Who made room need not wait for the next look.
Status Cell::may_book() {
  Status may = check_room(room_.free_bytes());
  if (!may) look_at_store();
  return may;
}

void Cell::refresh_counts() { counter_->count(); }

void Cell::take_counts(CellCounts counted) {
  counts = std::move(counted);
  counted_ = true;
  remnant_clerk->look();
  broadcast_status();
}

void Cell::look_regularly() {
  look_timer_.expires_after(std::chrono::milliseconds(500));
  look_timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (cancelled) return;
    note_untold(SteadyClock().now() - time_to_look);
    runner->look_again();
    if (counter_->has_failed()) refresh_counts();
    look_for_alarms();
    look_for_notices();
    end_leases();
    give_up_kept_scan();
    if (std::chrono::steady_clock::now() - store_looked_at_ > kLookAtStore) look_at_store();
    look_regularly();
  });
}

void Cell::give_up_kept_scan() {
  const auto kept = scans->kept();
  if (!kept || kept->since == given_up_) return;
  // It is hundreds of megabytes a tile, and the next scan has to find room beside it.
  const bool has_room = room_.free_bytes().value_or(kLittleRoom) >= kLittleRoom;
  if (!kept->is_over(utc_timestamp(-std::chrono::hours(24)), has_room)) return;
  given_up_ = kept->since;
  log->info("the {} tiles of the series that was refused at {} are kept no longer", kept->tiles, kept->since);
  scanner_worker->post([this] { scans->give_up_kept(); });
}

void Cell::leases_changed(const std::vector<PanelId>& touched) {
  for (const PanelId& panel : touched) hub.broadcast({{"type", "panel"}, {"panel", panel.value}});
  database->async([](Repositories& r) { return r.leases.next_end(); },
                  [this](const Result<std::string>& next) {
                    if (next) lease_end_ = *next;
                  });
}

// The clock is asked again and again, because it may have been set meanwhile; the database only once it is time.
void Cell::end_leases() {
  if (lease_end_.empty() || utc_timestamp() < lease_end_) return;
  lease_end_ = utc_timestamp(std::chrono::minutes(1));  // until it is known better: if it fails, then again
  database->async(expire_leases, [this](const Result<EndedLeases>& ended) {
    if (!ended) return log->warn("leases that are over could not be ended: {}", ended.error().message);
    for (const std::string& sentence : ended->sentences) log->info("{}", sentence);
    leases_changed(ended->panels);
  });
}

// The unit's reason may be the sentence of a laser that did not answer.
void Cell::leave_out_places(json& status, const LaserStatus& laser) const {
  status["laser"]["port"] = nullptr;
  const std::string &why = laser.why_not_connected, &reason = runner->view().reason;
  if (!why.empty() && reason.find(why) != std::string::npos) status["reason"] = kLaserIsSilent;
  strike_places(status, config.laser);
}

json Cell::status(Role told) const {
  const CellView& view = runner->view();
  const LaserStatus laser = devices.laser->status();
  json out = {
      {"schema_version", 1}, {"state", to_string(view.state)}, {"reason", view.reason}, {"panels", counts.panels}};
  out["laser"] = {{"connected", laser.connected},
                  {"state", laser.state},
                  {"beam_on", laser.beam_on},
                  {"homed", laser.homed},
                  {"firmware", laser.firmware},
                  {"position_mm", nullptr},
                  {"finds_home", runner->limits().finds_home},
                  {"overrides", overrides_json(laser.overrides)},
                  {"overrides_wanted", overrides_json(laser.overrides_wanted)}};
  const bool told_all = told >= Role::kOperator;
  if (!laser.connected)
    out["laser"]["why_not_connected"] =
        told_all || laser.why_not_connected.empty() ? laser.why_not_connected : kLaserIsSilent;
  out["laser"]["controller"] = controller_at(config.laser);
  out["laser"]["kind"] = config.laser.kind;
  out["laser"]["port"] = config.laser.kind != "sim" ? json(config.laser.port) : json();
  out["laser"]["set_by"] = to_string(config.laser.set_by);
  out["laser"]["refusal"] = laser.refusal.empty() ? json() : json(laser.refusal);
  if (laser.homed) out["laser"]["position_mm"] = {laser.position.x.count(), laser.position.y.count()};
  out["lid"] = !laser.connected || !laser.lid_open ? "unknown" : *laser.lid_open ? "open" : "closed";
  out["job"] = nullptr;
  if (view.job) {
    const JobView& job = *view.job;
    out["job"] = {{"id", job.id.value},
                  {"name", job.name},
                  {"state", to_string(view.state)},
                  {"now", nullptr},
                  {"pieces", job.pieces},
                  {"cut", job.cut},
                  {"suspect", job.suspect},
                  {"current_piece", job.current_piece.empty() ? json() : json(job.current_piece)},
                  {"eta_s", job.eta_seconds > 0 ? json(job.eta_seconds / config.sim.time_scale) : json()}};
  }
  if (const std::string now = view.job ? now_words(view, view.job->id) : ""; !now.empty()) out["job"]["now"] = now;
  const std::string next = next_words(view, counts.panels_to_scan);
  out["next"] = next.empty() ? json() : json(next);
  out["next_step"] = step_json(this->next());
  out["panels_to_scan"] = {{"count", counts.panels_to_scan.size()}, {"panels", json::array()}};
  for (std::size_t i = 0; i < std::min(counts.panels_to_scan.size(), kWaitingNamed); ++i)
    out["panels_to_scan"]["panels"].push_back(counts.panels_to_scan[i].value);
  if (integrity->state() != DatabaseCheck::State::kGood && view.reason.empty()) out["reason"] = integrity->sentence();
  out["database"] = integrity->to_json();
  out["load"] = nullptr;
  if (view.load) out["load"] = load_json(*view.load, runner->options(), config.sim.time_scale);
  out["framing"] = view.framing;
  out["may_be_watched"] = runner->may_be_watched().ok();
  out["recut"] =
      view.can_recut > 0
          ? json{{"job", view.recut_job.value}, {"panel", view.recut_panel.value}, {"pieces", view.can_recut}}
          : json();
  out["owed_look"] = nullptr;
  if (const auto& owed = view.owed_look)
    out["owed_look"] = {
        {"job", owed->job.value}, {"panel", owed->panel.value}, {"pieces", owed->pieces}, {"sentence", owed->sentence}};
  out["open_scan"] = nullptr;
  if (const auto open = scans->open())
    out["open_scan"] = {{"panel", open->panel ? json(open->panel->value) : json()},
                        {"face", to_string(open->face)},
                        {"tiles", open->tiles},
                        {"retag", open->retag}};
  out["kept_scan"] = nullptr;
  if (const auto kept = scans->kept()) out["kept_scan"] = {{"tiles", kept->tiles}, {"since", kept->since}};
  out["confirm"] = asked_by_name();
  out["calibration"] = json::object();
  for (const auto& [kind, state] : certificates()) out["calibration"][db::to_string(kind)] = to_string(state);
  out["interlocks"] = interlocks_json(laser, told_all);
  out["alarms"] = {{"new", alarms.count(AlarmState::kNew)},
                   {"acknowledged", alarms.count(AlarmState::kAcknowledged)},
                   {"returned", alarms.count(AlarmState::kReturned)}};
  out["hands"] = devices.hands.has_value();
  out["tasks"] = json::array();
  for (const auto* task : tasks.running()) out["tasks"].push_back(to_list_json(*task));
  if (!told_all) leave_out_places(out, laser);
  return out;
}

std::vector<CellNeeds::Certificate> Cell::certificates() const {
  std::vector<CellNeeds::Certificate> out;
  for (const auto kind : {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                          db::CertificateKind::kKerf})
    out.push_back({kind, counts.calibration ? counts.calibration->standing.at(kind).at(utc_timestamp())
                                            : CertificateState::kMissing});
  return out;
}

std::vector<std::string> Cell::asked_by_name() const {
  std::vector<std::string> out = runner->options().confirm;
  out.insert(out.end(), runner->limits().to_confirm.begin(), runner->limits().to_confirm.end());
  return out;
}

CellNeeds Cell::needs() const {
  CellNeeds needs;
  needs.database_damaged = integrity->state() == DatabaseCheck::State::kDamaged;
  needs.database_busy = integrity->sentence();
  needs.choice_lost = choice_lost_;
  needs.certificates = certificates();
  if (calibrations) needs.camera_views = calibrations->collected().view_heights;
  needs.panels = counts.panels;
  needs.proposal = counts.proposal;
  needs.to_scan = counts.panels_to_scan;
  needs.confirm = asked_by_name();
  needs.job = counts.job;
  needs.plan = counts.plan;
  needs.suspects = counts.suspects;
  needs.missing = counts.missing;
  needs.backups_silent = backup_disk->silence();
  needs.device_seconds_per_second = config.sim.time_scale;
  return needs;
}

NextStep Cell::next() const { return next_step(runner->view(), needs()); }

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

Status Cell::may_be_noted(const Caller& caller) const {
  if (audit_log_->has_room(caller.who)) return Ok();
  return Error{ErrorCode::kUnavailable,
               "you ask for more than can be written into the audit log: wait a second and ask again"};
}

void Cell::audit(const Router::Change& change) {
  if (std::this_thread::get_id() != reactor_thread_)
    return boost::asio::post(reactor, [this, alive = std::weak_ptr<int>(alive_), caller = change.caller,
                                       operation = std::string(change.operation), detail = change.detail,
                                       refused = change.refused, task = change.task] {
      if (!alive.expired()) audit({caller, operation, detail, refused, task});
    });
  if (change.task) {
    const TaskView* task = tasks.find(*change.task);
    const bool is_over = !task || task->state != TaskState::kRunning;
    if (untold_.began(*change.task, is_over, change.caller, [this](const std::string& who) { return listens(who); }))
      keep_tasks();
    return task_audit_->began(*change.task, change.caller.who, std::string(change.operation));
  }
  const LogAbout about({.who = change.caller.who});
  if (change.caller.role >= Role::kOperator)
    log->info("{}: {}{}{}{}", change.caller.who, change.operation, change.refused ? " was refused" : "",
              change.detail.empty() ? "" : ", ", change.detail);
  db::AuditEntry entry{0, utc_timestamp(), change.caller.who,
                       fmt::format("api.{}{}", change.operation, change.refused ? ".refused" : ""), change.detail};
  if (change.caller.role < Role::kOperator) return audit_log_->write_or_count(std::move(entry));
  audit_log_->write(std::move(entry));
}

Status Cell::audit_now(const std::string& who, const std::string& what, const std::string& detail) const {
  const LogAbout about({.who = who});
  log->info("{}: {}, {}", who, what, detail);
  return database->call([&](Repositories& r) { return r.audit.append({0, utc_timestamp(), who, what, detail}); });
}

void Cell::broadcast_status() {
  if (!runner || hub.clients() == 0) return;
  hub.broadcast_passing(json{{"type", "status"}, {"status", status(Role::kOperator)}},
                        json{{"type", "status"}, {"status", status(Role::kViewer)}});
}

}  // namespace veneer::daemon
