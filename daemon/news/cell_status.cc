#include "daemon/news/cell_status.h"

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "daemon/devices/device_places.h"
#include "daemon/news/interlocks.h"
#include "daemon/unit/at_rest.h"
#include "daemon/unit/job_words.h"

namespace veneer::daemon {

using nlohmann::json;

namespace {

// Of panels that wait for a scan: a status is sent again and again.
constexpr std::size_t kWaitingNamed = 20;

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

json step_json(const NextStep& next) {
  return {{"step", to_string(next.step)},
          {"sentence", next.sentence},
          {"command", next.command.empty() ? json() : json(next.command)},
          {"job", next.job ? json(*next.job) : json()}};
}

json overrides_json(const LaserOverrides& o) { return {{"feed", o.feed}, {"rapid", o.rapid}, {"power", o.power}}; }

}  // namespace

// The unit's reason may be the sentence of a laser that did not answer, and stands in the chain as well.
void CellStatus::leave_out_places(json& status, const LaserStatus& laser) const {
  status["laser"]["port"] = nullptr;
  strike_why(status, laser.why_not_connected);
  strike_places(status, p_.config.laser);
}

json CellStatus::tell(Role told) const {
  const CellView& view = p_.unit.view();
  const LaserStatus laser = p_.laser.status();
  json out = {
      {"schema_version", 1}, {"state", to_string(view.state)}, {"reason", view.reason}, {"panels", p_.counts.panels}};
  out["laser"] = {{"connected", laser.connected},
                  {"state", laser.state},
                  {"beam_on", laser.beam_on},
                  {"homed", laser.homed},
                  {"firmware", laser.firmware},
                  {"position_mm", nullptr},
                  {"finds_home", p_.unit.limits().finds_home},
                  {"overrides", overrides_json(laser.overrides)},
                  {"overrides_wanted", overrides_json(laser.overrides_wanted)}};
  const bool told_all = told >= Role::kOperator;
  if (!laser.connected)
    out["laser"]["why_not_connected"] =
        told_all || laser.why_not_connected.empty() ? laser.why_not_connected : kLaserIsNotConnected;
  out["laser"]["controller"] = controller_at(p_.config.laser);
  out["laser"]["kind"] = p_.config.laser.kind;
  out["laser"]["port"] = p_.config.laser.kind != "sim" ? json(p_.config.laser.port) : json();
  out["laser"]["set_by"] = to_string(p_.config.laser.set_by);
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
                  {"eta_s", job.eta_seconds > 0 ? json(job.eta_seconds / p_.config.sim.time_scale) : json()}};
  }
  if (const std::string now = view.job ? now_words(view, view.job->id) : ""; !now.empty()) out["job"]["now"] = now;
  const std::string next = next_words(view, p_.counts.panels_to_scan);
  out["next"] = next.empty() ? json() : json(next);
  out["next_step"] = step_json(this->next());
  out["panels_to_scan"] = {{"count", p_.counts.panels_to_scan.size()}, {"panels", json::array()}};
  for (std::size_t i = 0; i < std::min(p_.counts.panels_to_scan.size(), kWaitingNamed); ++i)
    out["panels_to_scan"]["panels"].push_back(p_.counts.panels_to_scan[i].value);
  if (p_.integrity.state() != DatabaseCheck::State::kGood && view.reason.empty())
    out["reason"] = p_.integrity.sentence();
  out["database"] = p_.integrity.to_json();
  out["load"] = nullptr;
  if (view.load) out["load"] = load_json(*view.load, p_.options, p_.config.sim.time_scale);
  out["framing"] = view.framing;
  out["may_be_watched"] = check_may_be_watched(view.state).ok();
  out["recut"] =
      view.can_recut > 0
          ? json{{"job", view.recut_job.value}, {"panel", view.recut_panel.value}, {"pieces", view.can_recut}}
          : json();
  out["owed_look"] = nullptr;
  if (const auto& owed = view.owed_look)
    out["owed_look"] = {
        {"job", owed->job.value}, {"panel", owed->panel.value}, {"pieces", owed->pieces}, {"sentence", owed->sentence}};
  out["open_scan"] = nullptr;
  if (const auto open = p_.open_scan())
    out["open_scan"] = {{"panel", open->panel ? json(open->panel->value) : json()},
                        {"face", to_string(open->face)},
                        {"tiles", open->tiles},
                        {"retag", open->retag}};
  out["kept_scan"] = nullptr;
  if (const auto kept = p_.kept_scan()) out["kept_scan"] = {{"tiles", kept->tiles}, {"since", kept->since}};
  out["confirm"] = asked_by_name();
  out["calibration"] = json::object();
  for (const auto& [kind, state] : certificates()) out["calibration"][db::to_string(kind)] = to_string(state);
  out["interlocks"] = interlocks_json(laser, told_all);
  out["alarms"] = {{"new", p_.alarms.count(AlarmState::kNew)},
                   {"acknowledged", p_.alarms.count(AlarmState::kAcknowledged)},
                   {"returned", p_.alarms.count(AlarmState::kReturned)}};
  out["hands"] = p_.has_hands;
  out["tasks"] = json::array();
  for (const auto* task : p_.tasks.running()) out["tasks"].push_back(to_list_json(*task));
  if (!told_all) leave_out_places(out, laser);
  return out;
}

std::vector<CellNeeds::Certificate> CellStatus::certificates() const {
  const std::string now = utc_text(p_.now());
  std::vector<CellNeeds::Certificate> out;
  for (const auto kind : {db::CertificateKind::kScanner, db::CertificateKind::kCamera, db::CertificateKind::kAxes,
                          db::CertificateKind::kKerf})
    out.push_back(
        {kind, p_.counts.calibration ? p_.counts.calibration->standing.at(kind).at(now) : CertificateState::kMissing});
  return out;
}

std::vector<std::string> CellStatus::asked_by_name() const {
  std::vector<std::string> out = p_.options.confirm;
  out.insert(out.end(), p_.unit.limits().to_confirm.begin(), p_.unit.limits().to_confirm.end());
  return out;
}

CellNeeds CellStatus::needs() const {
  CellNeeds needs;
  needs.is_counted = is_counted();
  needs.database_damaged = p_.integrity.state() == DatabaseCheck::State::kDamaged;
  needs.database_busy = p_.integrity.sentence();
  needs.choice_lost = choice_lost_;
  needs.certificates = certificates();
  needs.camera_views = p_.camera_views();
  needs.panels = p_.counts.panels;
  needs.proposal = p_.counts.proposal;
  needs.to_scan = p_.counts.panels_to_scan;
  needs.confirm = asked_by_name();
  needs.job = p_.counts.job;
  needs.plan = p_.counts.plan;
  needs.suspects = p_.counts.suspects;
  needs.missing = p_.counts.missing;
  needs.backups_silent = p_.backups.silence();
  needs.device_seconds_per_second = p_.config.sim.time_scale;
  return needs;
}

NextStep CellStatus::next() const { return next_step(p_.unit.view(), needs()); }

nlohmann::json CellStatus::interlocks_json(const LaserStatus& laser, bool tell_why) const {
  InterlockFacts facts;
  if (p_.guarded) facts.guardian = p_.guarded();
  facts.camera = p_.camera.last();
  facts.scanner = p_.scanner.last();
  facts.picture_fresh = p_.bed_pictures.last_fresh();
  facts.stock_refusal = p_.options.stock_refusal;
  facts.free_bytes = p_.disk.free_bytes();
  facts.backups = p_.backups.seen();
  facts.backups_silent = p_.backups.silence();
  facts.finds_home = p_.unit.limits().finds_home;
  facts.now = p_.now();
  facts.tell_why = tell_why;
  CellNeeds needed = needs();
  if (!is_counted()) needed.certificates.clear();  // nobody has read them yet
  return to_json(veneer::daemon::interlocks(p_.unit.view(), laser, needed, facts));
}

void CellStatus::look_for_lost_choice(DatabaseThread& database) {
  const bool open = p_.config.laser.set_by == SetBy::kNobody || p_.config.scanner.set_by == SetBy::kNobody ||
                    p_.config.camera.set_by == SetBy::kNobody;
  if (!open || p_.config.devices.chosen) return;
  database.async([](Repositories& r) { return r.audit.devices_were_chosen(); },
                 [this, alive = std::weak_ptr(alive_)](const Result<bool>& lost) {
                   if (!alive.expired()) choice_lost_ = lost && *lost;
                 });
}

}  // namespace veneer::daemon
