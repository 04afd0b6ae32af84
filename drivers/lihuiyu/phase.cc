// What phases share, and those in which no job runs.
#include "drivers/lihuiyu/phase.h"

#include <utility>

#include "drivers/lihuiyu/egv_encoder.h"
#include "drivers/lihuiyu/packet.h"
#include "drivers/overdue.h"

namespace veneer::lihuiyu {

void Phase::start(LaserJob&&) { fail({ErrorCode::kConflict, "the laser is busy"}); }

void Phase::serve_deadline() {
  if (!deadline_ || m_.now < *deadline_) return;
  deadline_.reset();
  deadline();
}

void Phase::drop_out(Error error, bool still_connected) {
  m_.homed = false;
  host_.tell(laser_event::Fault{std::move(error), still_connected});
}

void Phase::end_closed() { host_.enter(closed(m_, host_)); }

void Phase::reset_board() {
  m_.homed = false;
  m_.output.urgent = reset_packet();
  m_.output.requests.clear();
  host_.enter(resetting(m_, host_));
}

std::string_view firmware_of(Board board) { return board == Board::kM3 ? "Lihuiyu M3-Nano" : "Lihuiyu M2-Nano"; }

namespace {

class Disconnected : public Phase {
 public:
  using Phase::Phase;
  void home() override { fail({ErrorCode::kUnavailable, "the laser is not connected, so it cannot be homed"}); }
  void start(LaserJob&&) override { fail({ErrorCode::kUnavailable, "the laser is not connected"}); }
  bool connected() const override { return false; }
};

class Closed final : public Disconnected {
 public:
  using Disconnected::Disconnected;
  void abort() override {}
  void link_failed(const Error&) override {}
  void link_lost(const Error&) override {}
  bool uses_link() const override { return false; }
};

// The USB chip, then the board, within the time to connect.
class GettingThere : public Disconnected {
 public:
  GettingThere(Machine& machine, PhaseHost& host, TimePoint until) : Disconnected(machine, host) { deadline_ = until; }
  void abort() override {
    m_.output.urgent = reset_packet();
    give_up(stopped_by_command());
  }
  void link_lost(const Error& error) override {
    fail(error);
    end_closed();
  }
  void deadline() override {
    give_up(m_.link.knows_board() && m_.state == BoardState::kNoPower
                ? Error{ErrorCode::kUnavailable, "the laser board has no power: switch the laser's own supply on"}
                : Error{ErrorCode::kTimeout,
                        "no Lihuiyu board answers on the laser's port: check the laser's supply and the USB cable"});
  }

 protected:
  void give_up(const Error& error) {
    fail(error);
    close();
  }
};

class Connecting final : public GettingThere {
 public:
  using GettingThere::GettingThere;
  void entered() override {
    m_.link.restart(m_.now, true);
    m_.link.tick(m_.now);
  }
  void told(BoardState state) override {
    // A board without power is waited for until the deadline. The reset stops whatever a former host left running.
    if (!m_.link.sending() && state != BoardState::kNoPower) m_.link.send(reset_packet(), true, true, m_.now);
  }
  void accepted() override {
    LaserLimits limits{{point<MachineFrame>(0, 0), point<MachineFrame>(m_.options.travel_x_mm, m_.options.travel_y_mm)},
                       std::string(firmware_of(m_.options.board))};
    limits.burns = !m_.options.recording;
    limits.dark_ways = DarkWays::kWithinBox;  // first x, then y, or diagonally as far as that goes
    host_.enter(ready(m_, host_));
    host_.tell(laser_event::Connected{std::move(limits)});
  }
  void link_failed(const Error& error) override { give_up(error); }
};

class Configuring final : public GettingThere {
 public:
  Configuring(Machine& machine, PhaseHost& host)
      : GettingThere(machine, host, machine.now + machine.options.connect_timeout) {}
  void entered() override {
    m_.homed = false;
    m_.link.restart(m_.now, true);
    m_.output = {{}, {{epp_setup(), m_.options.write_timeout}}, false};
  }
  bool replied(const UsbReply& reply) override {
    if (reply.done)
      host_.enter(std::make_unique<Connecting>(m_, host_, *deadline_));
    else
      m_.output.requests = {{epp_setup(), m_.options.write_timeout}};
    return true;
  }
  void link_failed(const Error&) override {}
  bool uses_link() const override { return false; }
};

class Ready final : public Phase {
 public:
  using Phase::Phase;
  void home() override { host_.enter(homing(m_, host_)); }
  void start(LaserJob&& job) override {
    if (!m_.homed) return fail({ErrorCode::kRefused, "the laser does not know its position: home it first"});
    if (const Status checked = check_job(job, m_.grid); !checked.ok()) return fail(checked.error());
    host_.enter(burning(m_, host_, std::move(job)));
  }
  // The job may have ended in this very turn, and nobody has heard of it yet.
  void hold() override { host_.tell(laser_event::Held{}); }
  void abort() override { reset_board(); }
  void told(BoardState state) override {
    if (state == BoardState::kNoPower && std::exchange(m_.homed, false)) drop_out(power_lost(), true);
  }
  void link_failed(const Error& error) override {
    drop_out(error, false);
    close();
  }
  void link_lost(const Error& error) override {
    drop_out(error, false);
    end_closed();
  }
  Duration poll_period() const override { return m_.options.rest_poll_period; }
};

class Resetting final : public Phase {
 public:
  using Phase::Phase;
  void entered() override {
    // What was under way is given up. The urgent packet is not answered; another one is, and proves the reset.
    m_.link.restart(m_.now, false);
    m_.link.send(reset_packet(), true, true, m_.now);
  }
  void home() override { home_wanted_ = true; }
  void abort() override {
    if (home_wanted_) fail(stopped_by_command());  // it must not begin behind a STOP
    reset_board();
  }
  void accepted() override { host_.enter(home_wanted_ ? homing(m_, host_) : ready(m_, host_)); }
  void link_failed(const Error& error) override {
    if (std::exchange(home_wanted_, false)) fail(error);
    // The reset is repeated: it may arrive twice without harm.
    deadline_ = m_.now + m_.options.reset_retry;
    m_.link.restart(m_.now, false);
  }
  void link_lost(const Error& error) override {
    home_wanted_ ? fail(error) : drop_out(error, false);
    end_closed();
  }
  void deadline() override {
    if (!m_.link.sending()) m_.link.send(reset_packet(), true, true, m_.now);
  }

 private:
  bool home_wanted_ = false;
};

class Homing final : public Phase {
 public:
  using Phase::Phase;
  void entered() override {
    m_.homed = false;
    deadline_ = m_.now + m_.options.homing_timeout;
    m_.link.drain();
    m_.link.send(home_packet(), true, false, m_.now);
  }
  void home() override {}
  void abort() override { break_off(stopped_by_command()); }
  void accepted() override {
    sent_ = true;
    quiet_at_ = m_.now + m_.options.homing_wait;
  }
  void told(BoardState state) override;
  void link_failed(const Error& error) override { break_off(error); }
  void link_lost(const Error& error) override {
    fail(error);
    end_closed();
  }
  void deadline() override {
    break_off({ErrorCode::kTimeout, overdue_words("the laser did not finish homing in time", "Clear and Reset")});
  }

 private:
  void break_off(const Error& error) {
    fail(error);
    reset_board();
  }

  bool sent_ = false;
  TimePoint quiet_at_;
  int quiet_statuses_ = 0;
};

// The board does not say when it is home.
void Homing::told(BoardState state) {
  constexpr int kQuietStatuses = 3;  // in a row that are not busy
  if (!sent_) return;
  if (state == BoardState::kNoPower)
    return break_off({ErrorCode::kDeviceFault, "the laser board lost its power while homing"});
  if (state == BoardState::kBusy || m_.now < quiet_at_) {
    quiet_statuses_ = 0;
    return;
  }
  if (++quiet_statuses_ < kQuietStatuses) return;
  m_.at = {};
  m_.homed = true;
  host_.enter(ready(m_, host_));
  host_.tell(laser_event::Homed{});
}

}  // namespace

std::unique_ptr<Phase> closed(Machine& machine, PhaseHost& host) { return std::make_unique<Closed>(machine, host); }
std::unique_ptr<Phase> configuring(Machine& machine, PhaseHost& host) {
  return std::make_unique<Configuring>(machine, host);
}
std::unique_ptr<Phase> ready(Machine& machine, PhaseHost& host) { return std::make_unique<Ready>(machine, host); }
std::unique_ptr<Phase> resetting(Machine& machine, PhaseHost& host) {
  return std::make_unique<Resetting>(machine, host);
}
std::unique_ptr<Phase> homing(Machine& machine, PhaseHost& host) { return std::make_unique<Homing>(machine, host); }

}  // namespace veneer::lihuiyu
