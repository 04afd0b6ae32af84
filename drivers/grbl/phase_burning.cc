// A job under way, and its end when something is wrong: a feed hold first where the place can still be kept.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/grbl/phase.h"
#include "drivers/grbl/stray_path.h"
#include "drivers/overdue.h"

namespace veneer::grbl {
namespace {

// What is known of a job under way when it is broken off.
struct Burn {
  JobRun run;
  StrayPath stray;

  // The head may be elsewhere than its reports and answers made believe. Before the beam was on that harms no wood.
  void doubt_place() {
    if (run.burning_begun()) stray.strayed();
  }
  // Of a job that was checked whole: a hard limit was met, or a move would leave the travel.
  void take_alarm(int number) {
    if (number == 1 || number == 2) doubt_place();
  }
};

// Behind a reset.
void end_burn(Machine& m, PhaseHost& host, const Burn& burn, const Error& error, bool position_lost) {
  laser_event::Aborted aborted{error, burn.run.suspect(), position_lost};
  if (burn.stray.any()) burn.stray.add_to(aborted, burn.run, m.settings, m.options.position_tolerance, m.now);
  if (position_lost) m.homed = false;
  host.enter(resetting(m, host));
  m.ask(m.options.fast_poll_period);
  host.tell(std::move(aborted));
}

// Standing still with the beam off. "Hold:1" and "Door:2" still move.
bool at_rest(const StatusReport& report, bool lines_outstanding) {
  const bool still = report.state == "Hold:0" || report.state == "Hold" || report.state == "Door:0" ||
                     report.state == "Door:1" || (report.is("Idle") && !lines_outstanding);
  return still && report.power.value_or(0) == 0;
}

// Feed hold, then the reset byte once the machine stands still; the position is kept.
class Stopping final : public Phase {
 public:
  Stopping(Machine& machine, PhaseHost& host, Burn burn, Error error)
      : Phase(machine, host), burn_(std::move(burn)), error_(std::move(error)) {}

  void entered() override {
    m_.realtime('!');
    deadline_ = m_.now + m_.options.stop_timeout;
    m_.ask_afresh(m_.options.fast_poll_period / 2);
  }
  void home() override { fail({ErrorCode::kConflict, "a job is running: stop it before homing the laser"}); }
  void abort() override { end(true); }
  void alarm(int number) override {
    burn_.take_alarm(number);
    end(true);
  }
  void banner(const Banner&) override {
    m_.corner.forget();
    end(true);
  }
  void reported(const StatusReport& report, const Heard&) override {
    if (m_.position()) burn_.stray.stopping(*m_.position(), m_.now);
    if (report.is("Idle") || report.state == "Hold:0" || report.state == "Hold" || report.state == "Door:0" ||
        report.state == "Door:1")
      end(false);
  }
  void link_lost(const Error&) override {
    end_burn(m_, host_, burn_, error_, true);
    host_.enter(closed(m_, host_));
  }
  void deadline() override { end(true); }
  bool job_running() const override { return true; }
  double queued_motion_s() const override {
    return burn_.run.motion().queued_s() * m_.overrides.slowest_wanted() / m_.overrides.slowest();
  }

 private:
  void end(bool position_lost) {
    m_.reset();
    end_burn(m_, host_, burn_, error_, position_lost);
  }

  Burn burn_;
  Error error_;
};

class Burning final : public Phase {
 public:
  Burning(Machine& machine, PhaseHost& host, LaserJob job)
      : Phase(machine, host),
        burn_{JobRun(std::move(job), machine.settings, machine.options, *machine.place()),
              StrayPath(*machine.position(), machine.now)},
        last_progress_(machine.now) {
    motion().set_slowest(m_.overrides.slowest_wanted(), m_.now);
  }

  void entered() override {
    m_.ask();
    pump();
  }
  void home() override { fail({ErrorCode::kConflict, "a job is running: stop it before homing the laser"}); }
  void hold() override;
  void resume() override;
  void stop_after_piece() override { run().stop_after_piece(); }
  void abort() override {
    const bool stands_still = hold_ == Hold::kHeld;
    m_.reset();
    end(stopped_by_command(), !stands_still);
  }
  Status set_overrides(const LaserOverrides& overrides) override;
  void answered(const Outstanding& line, std::optional<int> error) override;
  // A line that arrived as two, perhaps: moves are relative, and what follows is displaced.
  void count_lost(const Error& error) override {
    burn_.doubt_place();
    emergency(error);
  }
  void alarm(int number) override {
    burn_.take_alarm(number);
    emergency({ErrorCode::kDeviceFault, alarm_words(number)});
  }
  void banner(const Banner&) override { emergency(reset_by_others()); }
  void modes_told(const ParserState& state) override;
  void reported(const StatusReport& report, const Heard& heard) override;
  void link_lost(const Error& error) override {
    end(error, true);
    host_.enter(closed(m_, host_));
  }
  void deadline() override;
  void tick() override;
  void pump() override;
  TimePoint next_deadline() const override;
  Duration poll_period() const override {
    const bool awaiting = hold_ == Hold::kRequested || hold_ == Hold::kResuming ||
                          (run().all_sent() && m_.outstanding().empty()) || !m_.overrides.settled();
    return awaiting ? m_.options.fast_poll_period : m_.options.poll_period;
  }
  bool job_running() const override { return true; }
  // At the speed the machine runs at now; an override that is wanted but not taken counts only for what is sent next.
  double queued_motion_s() const override {
    return motion().queued_s() * m_.overrides.slowest_wanted() / m_.overrides.slowest();
  }

 private:
  enum class Hold { kNone, kRequested, kHeld, kResuming };
  JobRun& run() { return burn_.run; }
  const JobRun& run() const { return burn_.run; }
  MotionQueue& motion() { return burn_.run.motion(); }
  const MotionQueue& motion() const { return burn_.run.motion(); }

  void drive_overrides();
  void follow_path(const std::optional<Poll>& poll);
  void off_path();
  void follow_hold(const StatusReport& report);
  void on_idle(const std::optional<Poll>& poll);
  void verify_group();
  std::string gap_words() const;
  void tell_executed();

  // The reset byte now; the position is lost.
  void emergency(const Error& error) {
    m_.reset();
    end(error, true);
  }
  void stop_softly(Error error) {
    over_ = true;
    host_.enter(std::make_unique<Stopping>(m_, host_, std::move(burn_), std::move(error)));
  }
  void end(const Error& error, bool position_lost) {
    over_ = true;
    end_burn(m_, host_, burn_, error, position_lost);
  }

  Burn burn_;
  Hold hold_ = Hold::kNone;
  int idle_reports_ = 0;
  std::optional<TimePoint> idle_since_;  // idle with lines unanswered
  TimePoint last_progress_;
  bool over_ = false;  // another phase is on
};

// ---- commands

void Burning::hold() {
  if (hold_ == Hold::kRequested || hold_ == Hold::kHeld) return;
  hold_ = Hold::kRequested;
  m_.realtime('!');
  deadline_ = m_.now + m_.options.hold_timeout;
  m_.ask_soon();
}

void Burning::resume() {
  if (hold_ != Hold::kHeld) return;
  // The lid is open: the controller would ignore the byte, the machine stays held.
  if (m_.says("Door") && m_.report()->state != "Door:0") return host_.tell(laser_event::Held{});
  hold_ = Hold::kResuming;
  m_.realtime('~');
  deadline_ = m_.now + m_.options.resume_timeout;
  // An answer on its way still tells of the hold.
  m_.ask_afresh(m_.options.fast_poll_period / 2);
}

Status Burning::set_overrides(const LaserOverrides& overrides) {
  if (Status allowed = m_.overrides.want(overrides); !allowed.ok()) return allowed;
  motion().set_slowest(m_.overrides.slowest_wanted(), m_.now);
  drive_overrides();
  return Ok();
}

void Burning::drive_overrides() {
  if (hold_ != Hold::kNone) return;
  // What is queued must still last no longer than allowed once it runs slower.
  if (m_.overrides.slowest_wanted() < m_.overrides.slowest() && motion().queued_s() > m_.options.queued_motion_s)
    return;
  m_.step_overrides();
}

// ---- lines and their answers

void Burning::pump() {
  // What was burnt before the overrides are what the operator asked for would be burnt otherwise.
  if (over_ || (run().nothing_sent() && !m_.overrides.settled())) return;
  while (hold_ == Hold::kNone) {
    const GcodeLine* line = run().next();
    if (line == nullptr || !m_.fits(*line)) return;
    m_.send(*line);
    idle_since_.reset();
    run().sent(m_.now);
  }
}

void Burning::answered(const Outstanding& line, std::optional<int> error) {
  idle_since_.reset();
  last_progress_ = m_.now;
  if (error) {
    burn_.stray.strayed();  // moves are relative: what follows the refused line is displaced by it
    std::string text = line.line.text;
    text.pop_back();
    return stop_softly(
        {ErrorCode::kDeviceFault, fmt::format("the laser controller refused line {} \"{}\" with {}", line.number, text,
                                              describe_error(*error, m_.settings.family))});
  }
  run().acknowledged(line.line, m_.now);
  if (line.line.kind != LineKind::kEcho || std::exchange(m_.modes_told, false)) return;
  burn_.doubt_place();
  stop_softly({ErrorCode::kDeviceFault,
               fmt::format("the laser controller did not tell how it understood stroke {}, so its answers "
                           "do not match the lines it was sent: check the cable for disturbance, then Clear and Reset",
                           line.line.stroke)});
}

void Burning::modes_told(const ParserState& state) {
  // Answers come in order: this one belongs to the oldest $G that is unanswered.
  const auto& lines = m_.outstanding();
  const auto asked = std::find_if(lines.begin(), lines.end(),
                                  [](const Outstanding& waiting) { return waiting.line.kind == LineKind::kEcho; });
  if (asked == lines.end()) return;
  const GcodeLine& line = asked->line;
  const bool burning = line.power != GcodeLine::kAny;
  const bool inches = !state.has("G21");
  const bool place = state.has("G91") && !inches && (!burning || state.has(fmt::format("G{}", line.motion)));
  if (place && state.has("G94") && state.has("M4") && std::abs(state.feed - line.feed) < 1 &&
      (!burning || std::abs(state.power - line.power) < 1))
    return;
  if (!place) burn_.doubt_place();
  if (inches && run().burning_begun()) burn_.stray.strayed_at_any_speed();
  stop_softly(
      {ErrorCode::kDeviceFault,
       fmt::format("the laser controller understood stroke {} as \"{}\", it was sent G91 G21 G94 M4 F{}{}: check the "
                   "cable for disturbance, then Clear and Reset",
                   line.stroke, state.text, line.feed,
                   burning ? fmt::format(" G{} S{}", line.motion, line.power) : "")});
}

// ---- reports

void Burning::reported(const StatusReport& report, const Heard& heard) {
  if (heard.moved) last_progress_ = m_.now;
  if (heard.overrides_by_others)
    return stop_softly(
        {ErrorCode::kDeviceFault, "the speed or power override of the laser was changed at the machine"});
  motion().set_slowest(m_.overrides.slowest_wanted(), m_.now);
  if (!report.is("Idle") && !report.is("Run") && !report.is("Hold") && !report.is("Door"))
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser went into state \"{}\" in the middle of a job", report.state)});
  // The lid's interlock darkens the tube at once, the head stands still only later: what lies between is not burnt.
  const auto& at = m_.position();
  if (report.is("Door") && hold_ != Hold::kHeld && at && motion().may_have_burnt((*at)[0], (*at)[1])) run().doubt(*at);
  follow_path(heard.poll);
  if (!over_) follow_hold(report);
  if (over_) return;
  if (hold_ == Hold::kNone && report.is("Idle")) {
    on_idle(heard.poll);
  } else if (hold_ == Hold::kNone) {
    idle_since_.reset();
    idle_reports_ = 0;
  }
  if (!over_) drive_overrides();
}

void Burning::follow_path(const std::optional<Poll>& poll) {
  if (!m_.position()) return;
  const auto [x, y] = *m_.position();
  const MmPerSecond fastest = run().fastest_in_flight();  // what is executed by now included
  if (!motion().reported(x, y, m_.now)) return off_path();
  burn_.stray.on_path(*m_.position(), m_.now, fastest);
  tell_executed();
  // A feed that lost a digit makes a short motion last for minutes, and the beam stands almost still.
  const double late_s = poll && hold_ == Hold::kNone ? motion().late_s(x, y, poll->at) : 0;
  if (late_s <= std::chrono::duration<double>(m_.options.late_tolerance).count()) return;
  // Two lines that arrived as one may have led aside and back between two reports.
  if (run().burning_begun()) burn_.stray.late();
  stop_softly({ErrorCode::kDeviceFault,
               fmt::format("the laser is {:.1f} s later than its settings allow at ({:.3f}, {:.3f}) in its own "
                           "coordinates, because its controller was busy with something else, this computer was too "
                           "loaded to feed it, or a byte was changed on the cable: end other heavy programs, check the "
                           "cable, then Clear and Reset",
                           late_s, x, y)});
}

void Burning::off_path() {
  const auto [x, y] = *m_.position();
  // One report may itself be garbled: another one is asked for at once.
  if (burn_.stray.off_path(*m_.position(), m_.now) < 2) return m_.ask_soon(m_.options.fast_poll_period / 2);
  burn_.stray.strayed();
  stop_softly({ErrorCode::kDeviceFault,
               fmt::format("the laser is off its path at ({:.3f}, {:.3f}) in its own coordinates, because a byte was "
                           "lost or changed on the cable: check it for disturbance, then Clear and Reset",
                           x, y)});
}

void Burning::follow_hold(const StatusReport& report) {
  const bool stopped = report.is("Hold") || report.is("Door");
  switch (hold_) {
    case Hold::kNone:
      if (!stopped) return;
      // The lid, or a button on the machine.
      hold_ = Hold::kRequested;
      deadline_ = m_.now + m_.options.hold_timeout;
      [[fallthrough]];
    case Hold::kRequested:
      if (!at_rest(report, !m_.outstanding().empty())) return;
      hold_ = Hold::kHeld;
      deadline_.reset();
      return host_.tell(laser_event::Held{});
    case Hold::kHeld:
      if (report.is("Run"))
        emergency({ErrorCode::kDeviceFault,
                   "the laser began to move while it was held, and nothing here asked it to: see that nobody uses its "
                   "controller's own buttons and no other program its port, then Clear and Reset"});
      return;
    case Hold::kResuming:
      if (report.state == "Door:1" || report.state == "Door:2") {  // the lid was opened again
        hold_ = Hold::kRequested;
        deadline_ = m_.now + m_.options.hold_timeout;
        return;
      }
      if (stopped) return;
      hold_ = Hold::kNone;
      deadline_.reset();
      last_progress_ = m_.now;
      motion().went_on(m_.now);
      return host_.tell(laser_event::Resumed{});
  }
}

void Burning::on_idle(const std::optional<Poll>& poll) {
  if (!m_.outstanding().empty()) {
    idle_reports_ = 0;
    if (!idle_since_) idle_since_ = m_.now;
    return;
  }
  idle_since_.reset();
  // An answer to a question asked before the last line was answered says nothing.
  if (!poll || !poll->nothing_outstanding || poll->lines_sent != m_.lines_sent()) return;
  if (++idle_reports_ < 2) return;
  idle_reports_ = 0;
  verify_group();
}

void Burning::verify_group() {
  const WirePoint expected = motion().end();
  const double dx = (*m_.position())[0] - static_cast<double>(expected.x_um) / 1000;
  const double dy = (*m_.position())[1] - static_cast<double>(expected.y_um) / 1000;
  const double tolerance = m_.options.position_tolerance.count();
  if (std::abs(dx) > tolerance + 0.5 / m_.settings.x.steps_per_mm ||
      std::abs(dy) > tolerance + 0.5 / m_.settings.y.steps_per_mm) {
    burn_.stray.slipped(std::hypot(dx, dy));
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser stands ({:.3f}, {:.3f}) mm from where the piece ends, because bytes were "
                                  "lost or changed on the way: check the cable, then Clear and Reset",
                                  dx, dy)});
  }
  motion().all_executed();
  tell_executed();
  if (!run().all_sent()) return;  // the queue had run dry, nothing more
  if (run().doubt_at() && run().piece() != PieceId{}) {
    m_.reset();
    return end(
        {ErrorCode::kDeviceFault,
         fmt::format("{}. The rest of the piece is finished: look at it before the panel is moved and say whether "
                     "it is cut (veneerctl job settle); Clear, Reset and Start go on with the other pieces",
                     gap_words())},
        false);
  }
  if (const auto piece = run().verified()) host_.tell(laser_event::PieceVerified{*piece});
  if (!run().finished()) return;
  laser_event::Done done{run().stopped_early(), run().doubt_at() ? gap_words() : ""};
  over_ = true;
  host_.enter(ready(m_, host_));
  host_.tell(std::move(done));
}

// The lid's interlock may cut the tube's supply at once, while the head takes until it stands still. Whether there is
// one, and what it does, nobody tells.
std::string Burning::gap_words() const {
  const auto& [x, y] = *run().doubt_at();
  const Point<MachineFrame> at = m_.settings.from_wire(x, y);
  return fmt::format(
      "the lid was opened while the beam was on; if its switch darkens the tube at once, there may be a gap in the cut "
      "before ({:.1f}, {:.1f}) mm on the bed",
      at.x.count(), at.y.count());
}

void Burning::tell_executed() {
  for (const std::size_t stroke : motion().take_executed()) host_.tell(laser_event::StrokeExecuted{stroke});
}

// ---- time

void Burning::deadline() {
  if (hold_ == Hold::kRequested)
    return emergency(
        {ErrorCode::kDeviceFault,
         overdue_words("the laser did not stand still with the beam off after a hold", "Clear and Reset")});
  if (hold_ != Hold::kResuming) return;
  hold_ = Hold::kHeld;
  host_.tell(laser_event::Held{});
}

void Burning::tick() {
  if (hold_ != Hold::kNone) return;
  if (idle_since_ && m_.now - *idle_since_ >= m_.options.lost_reply_timeout)
    return emergency(
        {ErrorCode::kDeviceFault,
         fmt::format("the laser is idle but left {} lines unanswered, from line {} on, so answers were lost "
                     "on the cable or this computer was too loaded to take them: check the cable for "
                     "disturbance, end other heavy programs, then Clear and Reset",
                     m_.outstanding().size(), m_.outstanding().front().number)});
  if (m_.now - last_progress_ >= m_.options.stall_timeout)
    emergency({ErrorCode::kDeviceFault, overdue_words("the laser neither moves nor answers lines", "Clear and Reset")});
}

TimePoint Burning::next_deadline() const {
  TimePoint next = Phase::next_deadline();
  if (hold_ != Hold::kNone) return next;
  if (idle_since_) next = std::min(next, *idle_since_ + m_.options.lost_reply_timeout);
  return std::min(next, last_progress_ + m_.options.stall_timeout);
}

}  // namespace

std::unique_ptr<Phase> burning(Machine& machine, PhaseHost& host, LaserJob job) {
  return std::make_unique<Burning>(machine, host, std::move(job));
}

}  // namespace veneer::grbl
