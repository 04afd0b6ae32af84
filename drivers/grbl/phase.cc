// What phases share, and those in which the machine has nothing to do: closed, ready, waking, resetting.
#include "drivers/grbl/phase.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/overdue.h"

namespace veneer::grbl {

void Phase::start(LaserJob&&) { fail(busy()); }
Status Phase::check(const LaserJob&) { return busy(); }
Status Phase::jog(Millimetres, Millimetres, MmPerSecond) { return busy_for_jogs(); }
Status Phase::set_overrides(const LaserOverrides&) {
  return Error{ErrorCode::kConflict,
               "the laser is not ready for overrides: set them when it rests or while a job runs"};
}
Status Phase::corner_is_here() { return no_corner_now(); }

Error Phase::no_corner_now() const {
  if (m_.settings.homing) return {ErrorCode::kRefused, "this laser finds its corner itself: Reset homes it"};
  return {ErrorCode::kConflict, "the laser is busy: wait until it stands still"};
}

bool Phase::due(std::optional<TimePoint>& at) const {
  if (!at || m_.now < *at) return false;
  at.reset();
  return true;
}

TimePoint Phase::next_deadline() const {
  return std::min(deadline_.value_or(TimePoint::max()), settled_at_.value_or(TimePoint::max()));
}

void Phase::drop_out(Error error, bool still_connected) {
  m_.homed = false;
  host_.tell(laser_event::Fault{std::move(error), still_connected});
}

void Phase::reset() {
  m_.reset();
  host_.enter(resetting(m_, host_));
}

Error Phase::reset_by_others() {
  m_.corner.forget();
  return {ErrorCode::kDeviceFault,
          "the laser controller was reset, by itself or by a hand: check its power, then Clear and Reset"};
}

std::string Phase::alarm_words(int number) const {
  return fmt::format("the laser stopped with {}", describe_alarm(number, m_.settings.family));
}

namespace {

class Closed final : public Phase {
 public:
  using Phase::Phase;
  void entered() override { m_.disconnected(); }
  void home() override { fail({ErrorCode::kUnavailable, "the laser is not connected, so it cannot be homed"}); }
  void start(LaserJob&&) override { fail({ErrorCode::kUnavailable, "the laser is not connected"}); }
  Status check(const LaserJob&) override { return Error{ErrorCode::kUnavailable, "the laser is not connected"}; }
  Status jog(Millimetres, Millimetres, MmPerSecond) override {
    return Error{ErrorCode::kUnavailable, "the laser is not connected"};
  }
  Status corner_is_here() override {
    m_.corner.operator_says_here();
    return Ok();
  }
  void abort() override {}
  void alarm(int) override {}
  void banner(const Banner&) override {}
  void link_lost(const Error&) override {}
  TimePoint next_deadline() const override { return TimePoint::max(); }
  bool listens() const override { return false; }
  bool polls() const override { return false; }
  bool connected() const override { return false; }
};

class Ready : public Phase {
 public:
  using Phase::Phase;

  void home() override;
  void start(LaserJob&& job) override;
  Status check(const LaserJob& job) override;
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed) override;
  // The job may have ended in this very turn, and nobody has heard of it yet.
  void hold() override { host_.tell(laser_event::Held{}); }
  void abort() override { reset(); }
  Status set_overrides(const LaserOverrides& overrides) override;
  Status corner_is_here() override;
  void alarm(int number) override;
  void banner(const Banner&) override { drop_out(reset_by_others(), true); }
  void reported(const StatusReport& report, const Heard&) override;
  void link_lost(const Error& error) override {
    drop_out(error, false);
    host_.enter(closed(m_, host_));
  }
  Duration poll_period() const override {
    return m_.overrides.settled() ? m_.options.rest_poll_period : m_.options.fast_poll_period;
  }
};

void Ready::home() {
  if (!m_.says("Door")) return host_.enter(homing(m_, host_));
  if (m_.lid_open()) return fail({ErrorCode::kRefused, "the lid is open: close it, then Clear and Reset"});
  // A controller that waits for a cycle start after its lid was closed takes no line; a reset at rest ends the wait.
  m_.reset();
  host_.enter(resetting(m_, host_, true));
}

void Ready::start(LaserJob&& job) {
  if (m_.homed && m_.report() && m_.report()->state == "Door:0") {
    if (const Status good = check_job(job, m_.settings); !good.ok()) return fail(good.error());
    return host_.enter(waking(m_, host_, std::move(job)));
  }
  if (const Status allowed = job_allowed(m_, job); !allowed.ok()) return fail(allowed.error());
  host_.enter(burning(m_, host_, std::move(job)));
}

Status Ready::check(const LaserJob& job) {
  if (Status allowed = job_allowed(m_, job); !allowed.ok()) return allowed;
  host_.enter(checking(m_, host_, job));
  return Ok();
}

Status Ready::jog(Millimetres dx, Millimetres dy, MmPerSecond speed) {
  const JogWay way{dx, dy, speed};
  if (!m_.report() || !m_.position()) return busy_for_jogs();
  const bool waits_after_lid = m_.report()->state == "Door:0";
  if (m_.report()->state != "Idle" && !waits_after_lid)
    return Error{ErrorCode::kRefused,
                 fmt::format("the laser is not idle but says \"{}\": {}", m_.report()->state,
                             m_.lid_open() ? "close the lid, then Stop and Reset" : "Stop, then Reset")};
  auto lines = jog_lines(m_, way);
  if (!lines) return lines.error();
  host_.enter(waits_after_lid ? waking(m_, host_, way) : jogging(m_, host_, *std::move(lines)));
  return Ok();
}

Status Ready::set_overrides(const LaserOverrides& overrides) {
  if (Status allowed = m_.overrides.want(overrides); !allowed.ok()) return allowed;
  m_.step_overrides();
  return Ok();
}

Status Ready::corner_is_here() {
  if (m_.settings.homing) return no_corner_now();
  m_.corner.operator_says_here();
  if (m_.homed && m_.position() && m_.says("Idle")) {
    m_.settings.put_corner((*m_.position())[0], (*m_.position())[1]);
    m_.corner.taken();
  }
  return Ok();
}

void Ready::alarm(int number) {
  // After a hard limit GRBL answers nothing until it is reset.
  m_.reset();
  drop_out({ErrorCode::kDeviceFault, alarm_words(number)}, true);
  host_.enter(resetting(m_, host_));
}

void Ready::reported(const StatusReport& report, const Heard&) {
  m_.step_overrides();
  if (!m_.homed || !report.is("Alarm")) return;
  m_.reset();
  drop_out({ErrorCode::kDeviceFault, "the laser went into alarm: clear what stopped it, then Clear and Reset"}, true);
  host_.enter(resetting(m_, host_));
}

// Comes out of the wait after a closed lid, and then does what it was told to.
class Waking : public Ready {
 public:
  using Ready::Ready;

  void entered() override { wake(); }
  void home() override { fail(busy_for_homing()); }
  void start(LaserJob&&) override { fail(busy()); }
  Status check(const LaserJob&) override { return busy(); }
  Status jog(Millimetres, Millimetres, MmPerSecond) override { return busy_for_jogs(); }
  void abort() override {
    not_begun(stopped_by_command());
    reset();
  }
  Status corner_is_here() override { return no_corner_now(); }
  void banner(const Banner&) override {
    drop_out(reset_by_others(), true);
    host_.enter(ready(m_, host_));
  }
  void reported(const StatusReport& report, const Heard& heard) override {
    if (is_held() || !report.is("Idle")) return Ready::reported(report, heard);
    m_.step_overrides();
    begin();
  }
  void link_lost(const Error& error) override {
    not_begun(error);
    Ready::link_lost(error);
  }
  void deadline() override {
    if (m_.lid_open()) return give_up({ErrorCode::kRefused, "the laser still says that its lid is open: close it"});
    give_up({ErrorCode::kRefused, overdue_words(fmt::format("the laser still says \"{}\", though its lid is closed",
                                                            m_.report() ? m_.report()->state : ""),
                                                "try again")});
  }
  Duration poll_period() const override { return m_.options.fast_poll_period; }

 protected:
  virtual void begin() = 0;  // the controller is idle
  virtual void not_begun(const Error& error) = 0;
  virtual bool is_held() const { return false; }
  void wake() {
    m_.realtime('~');
    deadline_ = m_.now + m_.options.resume_timeout;
    // An answer on its way still tells of the time before.
    m_.ask_afresh(m_.options.fast_poll_period / 2);
  }
  void give_up(const Error& error) {
    host_.enter(ready(m_, host_));
    not_begun(error);
  }
};

class WakingForJob final : public Waking {
 public:
  WakingForJob(Machine& machine, PhaseHost& host, LaserJob job) : Waking(machine, host), job_(std::move(job)) {}

  void hold() override {
    if (std::exchange(held_, true)) return;
    deadline_.reset();
    host_.tell(laser_event::Held{});
  }
  void resume() override {
    if (!std::exchange(held_, false)) return;
    host_.tell(laser_event::Resumed{});
    wake();
  }

 private:
  void begin() override {
    if (const Status allowed = job_allowed(m_, job_); !allowed.ok()) return give_up(allowed.error());
    host_.enter(burning(m_, host_, std::move(job_)));
  }
  void not_begun(const Error& error) override { fail(error); }
  bool is_held() const override { return held_; }

  LaserJob job_;
  bool held_ = false;
};

class WakingForJog final : public Waking {
 public:
  WakingForJog(Machine& machine, PhaseHost& host, JogWay way) : Waking(machine, host), way_(way) {}

  void hold() override {}
  void stop_jog() override {
    host_.enter(ready(m_, host_));
    host_.tell(laser_event::JogEnded{});
  }
  void reported(const StatusReport& report, const Heard& heard) override {
    if (lid_is_open(report)) return give_up({ErrorCode::kRefused, "the lid was opened before the jog began: close it"});
    Waking::reported(report, heard);
  }

 private:
  void begin() override {
    auto lines = jog_lines(m_, way_);
    if (!lines) return give_up(lines.error());
    host_.enter(jogging(m_, host_, *std::move(lines)));
  }
  void not_begun(const Error& error) override { host_.tell(laser_event::JogEnded{error}); }

  JogWay way_;
};

// The banner that ends the reset is awaited. If it is lost, home() asks for another.
class Resetting final : public Phase {
 public:
  Resetting(Machine& machine, PhaseHost& host, bool then_home) : Phase(machine, host), home_wanted_(then_home) {}
  void entered() override {
    if (!home_wanted_) return m_.ask();
    deadline_ = m_.now + m_.options.banner_wait;
  }

  void home() override {
    home_wanted_ = true;
    if (m_.now - begin_ > m_.options.banner_wait) {
      settled_at_.reset();
      m_.reset();
    }
    deadline_ = m_.now + m_.options.banner_wait;
  }
  void abort() override {
    if (home_wanted_) fail(stopped_by_command());  // it must not begin behind a STOP
    reset();
  }
  Status corner_is_here() override {
    if (m_.settings.homing) return no_corner_now();
    m_.corner.operator_says_here();
    return Ok();
  }
  void alarm(int) override {}  // ALARM:3 answers a reset in motion
  void banner(const Banner&) override { settled_at_ = m_.now + m_.options.settle_time; }
  void settled() override { host_.enter(home_wanted_ ? homing(m_, host_) : ready(m_, host_)); }
  void deadline() override {
    if (std::exchange(home_wanted_, false))
      fail({ErrorCode::kTimeout, overdue_words("the laser controller does not come back from its reset",
                                               "Clear and Reset, or switch the laser off and on")});
  }
  void link_lost(const Error& error) override {
    home_wanted_ ? fail(error) : drop_out(error, false);
    m_.homed = false;
    host_.enter(closed(m_, host_));
  }

 private:
  bool home_wanted_;
};

}  // namespace

std::unique_ptr<Phase> closed(Machine& machine, PhaseHost& host) { return std::make_unique<Closed>(machine, host); }
std::unique_ptr<Phase> ready(Machine& machine, PhaseHost& host) { return std::make_unique<Ready>(machine, host); }
std::unique_ptr<Phase> waking(Machine& machine, PhaseHost& host, LaserJob job) {
  return std::make_unique<WakingForJob>(machine, host, std::move(job));
}
std::unique_ptr<Phase> waking(Machine& machine, PhaseHost& host, JogWay way) {
  return std::make_unique<WakingForJog>(machine, host, way);
}
std::unique_ptr<Phase> resetting(Machine& machine, PhaseHost& host, bool then_home) {
  return std::make_unique<Resetting>(machine, host, then_home);
}

Result<std::vector<GcodeLine>> jog_lines(const Machine& machine, const JogWay& way) {
  const MachineSettings& settings = machine.settings;
  const double fastest = std::min(settings.x.max_rate_mm_s, settings.y.max_rate_mm_s);
  if (!(way.speed.count() > 0 && way.speed.count() <= fastest))
    return Error{ErrorCode::kInvalidArgument, fmt::format("the laser is jogged at up to {:.0f} mm/s", fastest)};
  const Box<MachineFrame> travel = settings.travel();
  if (!(std::abs(way.dx.count()) <= travel.width().count() && std::abs(way.dy.count()) <= travel.height().count()))
    return Error{ErrorCode::kInvalidArgument, "the jog is longer than the laser's travel"};
  const auto here = settings.from_wire((*machine.position())[0], (*machine.position())[1]);
  if (machine.homed && !travel.contains({here.x + way.dx, here.y + way.dy}))
    return Error{ErrorCode::kRefused,
                 fmt::format("the jog leaves the travel (x {:.1f} to {:.1f} mm, y {:.1f} to {:.1f} mm): jog less far",
                             travel.min.x.count(), travel.max.x.count(), travel.min.y.count(), travel.max.y.count())};
  const WirePoint from = *machine.place();
  const WirePoint to{from.x_um + std::llround(way.dx.count() * 1000), from.y_um + std::llround(way.dy.count() * 1000)};
  return write_jog(from, to, way.speed, settings, machine.options.longest_move_s);
}

Status job_allowed(const Machine& machine, const LaserJob& job) {
  if (!machine.homed || !machine.position() || !machine.report())
    return Error{ErrorCode::kRefused, "the laser does not know its position: Stop, then Reset"};
  if (!machine.at_focus())
    return Error{ErrorCode::kRefused, "the laser's head is not at the focus height: Stop, then Reset moves it there"};
  if (machine.report()->state != "Idle")
    return Error{ErrorCode::kRefused, fmt::format("the laser is not idle but says \"{}\": {}", machine.report()->state,
                                                  machine.lid_open()     ? "close the lid"
                                                  : machine.says("Door") ? "Stop, then Reset"
                                                                         : "clear it, then Stop and Reset")};
  return check_job(job, machine.settings);
}

}  // namespace veneer::grbl
