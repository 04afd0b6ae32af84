#include "drivers/lihuiyu/lihuiyu_core.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace veneer::lihuiyu {
namespace {

// Statuses in a row that are not busy before the head counts as home.
constexpr int kQuietStatuses = 3;

}  // namespace

LihuiyuOptions LihuiyuOptions::for_time_scale(double scale) {
  LihuiyuOptions options;
  if (!(scale > 1)) return options;
  for (Duration* limit : {&options.connect_timeout, &options.silence_timeout, &options.busy_timeout,
                          &options.finish_timeout, &options.reset_retry, &options.homing_timeout})
    *limit = Duration(std::llround(static_cast<double>(limit->count()) * scale));
  return options;
}

LihuiyuCore::LihuiyuCore(const LihuiyuOptions& options)
    : options_(options), grid_{options.travel_x_mm, options.travel_y_mm}, link_(options) {}

// ---- commands

void LihuiyuCore::connect(TimePoint now) {
  now_ = now;
  homed_ = home_wanted_ = false;
  run_.reset();
  urgent_.clear();
  link_.restart(now_, true);
  requests_ = {{epp_setup(), options_.write_timeout}};
  enter(Phase::kConfiguring);
  deadline_ = now_ + options_.connect_timeout;
}

void LihuiyuCore::home(TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed || phase_ == Phase::kConfiguring || phase_ == Phase::kConnecting)
    return fail({ErrorCode::kUnavailable, "the laser is not connected, so it cannot be homed"});
  if (phase_ == Phase::kHoming) return;
  if (phase_ == Phase::kJob) return fail({ErrorCode::kConflict, "a job is running: stop it before homing the laser"});
  if (phase_ == Phase::kResetting) {
    home_wanted_ = true;
    return;
  }
  begin_homing();
}

void LihuiyuCore::start(LaserJob job, TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed || phase_ == Phase::kConfiguring || phase_ == Phase::kConnecting)
    return fail({ErrorCode::kUnavailable, "the laser is not connected"});
  if (phase_ != Phase::kReady) return fail({ErrorCode::kConflict, "the laser is busy"});
  if (!homed_) return fail({ErrorCode::kRefused, "the laser does not know its position: home it first"});
  if (const Status checked = check_job(job, grid_); !checked.ok()) return fail(checked.error());
  run_.emplace(std::move(job), grid_, options_, at_);
  hold_ = Hold::kNone;
  awaiting_end_ = false;
  program_begin_.reset();
  still_at_ = now_;
  enter(Phase::kJob);
  pump();
}

void LihuiyuCore::hold(TimePoint now) {
  now_ = now;
  if (phase_ != Phase::kJob || hold_ != Hold::kNone) return;
  hold_ = Hold::kRequested;
  check_hold();
}

void LihuiyuCore::resume(TimePoint now) {
  now_ = now;
  if (phase_ != Phase::kJob || hold_ != Hold::kHeld) return;
  hold_ = Hold::kNone;
  // The time held says nothing of motion.
  if (program_begin_) *program_begin_ += now_ - held_since_;
  if (awaiting_end_) deadline_ = now_ + options_.finish_timeout;
  events_.emplace_back(laser_event::Resumed{});
  pump();
}

void LihuiyuCore::stop_after_piece() {
  if (run_) run_->stop_after_piece();
}

void LihuiyuCore::abort(TimePoint now) {
  now_ = now;
  const Error cancelled{ErrorCode::kCancelled, "the laser was stopped by command"};
  switch (phase_) {
    case Phase::kClosed:
      return;
    case Phase::kJob:
      return emergency(cancelled);
    case Phase::kConfiguring:
    case Phase::kConnecting:
      urgent_ = reset_packet();
      fail(cancelled);
      close_ = true;
      return enter(Phase::kClosed);
    case Phase::kHoming:
      fail(cancelled);
      return reset_board();
    case Phase::kReady:
    case Phase::kResetting:
      return reset_board();
  }
}

// ---- what comes in

void LihuiyuCore::replied(const UsbReply& reply, TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed) return;
  if (phase_ == Phase::kConfiguring) {
    if (!reply.done) {
      requests_ = {{epp_setup(), options_.write_timeout}};
      return;
    }
    const auto deadline = deadline_;
    enter(Phase::kConnecting);
    deadline_ = deadline;
    link_.restart(now_, true);
    return link_.tick(now_);
  }
  link_.replied(reply, now_);
  listen();
}

void LihuiyuCore::listen() {
  const auto state = link_.take_state();
  if (link_.take_accepted()) on_accepted();
  if (state) on_state(*state);
  if (const auto failure = link_.take_failure()) on_failure(*failure);
}

void LihuiyuCore::on_accepted() {
  switch (phase_) {
    case Phase::kClosed:
    case Phase::kConfiguring:
    case Phase::kReady:
      return;
    case Phase::kConnecting:
      return finish_connect();
    case Phase::kResetting:
      enter(Phase::kReady);
      if (std::exchange(home_wanted_, false)) begin_homing();
      return;
    case Phase::kHoming:
      homing_sent_ = true;
      homing_quiet_at_ = now_ + options_.homing_wait;
      return;
    case Phase::kJob:
      return packet_accepted();
  }
}

void LihuiyuCore::on_state(BoardState state) {
  state_ = state;
  switch (phase_) {
    case Phase::kClosed:
    case Phase::kConfiguring:
    case Phase::kResetting:
      return;
    case Phase::kConnecting:
      // A board without power is waited for until the deadline. The reset stops whatever a former host left running.
      if (!link_.sending() && state != BoardState::kNoPower) link_.send(reset_packet(), true, true, now_);
      return;
    case Phase::kReady:
      if (state == BoardState::kNoPower && std::exchange(homed_, false))
        drop_out({ErrorCode::kDeviceFault,
                  "the laser board lost its power: check the lid, the emergency stop and the laser's supply"},
                 true);
      return;
    case Phase::kHoming:
      return on_homing_state(state);
    case Phase::kJob:
      return on_job_state(state);
  }
}

void LihuiyuCore::on_homing_state(BoardState state) {
  if (!homing_sent_) return;
  if (state == BoardState::kNoPower) {
    fail({ErrorCode::kDeviceFault, "the laser board lost its power while homing"});
    return reset_board();
  }
  if (state == BoardState::kBusy || now_ < homing_quiet_at_) {
    quiet_statuses_ = 0;
    return;
  }
  if (++quiet_statuses_ < kQuietStatuses) return;
  at_ = {};
  homed_ = true;
  enter(Phase::kReady);
  events_.emplace_back(laser_event::Homed{});
}

void LihuiyuCore::on_failure(const Error& error) {
  switch (phase_) {
    case Phase::kClosed:
    case Phase::kConfiguring:
      return;
    case Phase::kConnecting:
      fail(error);
      close_ = true;
      return enter(Phase::kClosed);
    case Phase::kReady:
      drop_out(error, false);
      close_ = true;
      return enter(Phase::kClosed);
    case Phase::kResetting:
      if (home_wanted_) fail(error);
      // The reset is repeated: it may arrive twice without harm.
      deadline_ = now_ + options_.reset_retry;
      return link_.restart(now_, false);
    case Phase::kHoming:
      fail(error);
      return reset_board();
    case Phase::kJob:
      return emergency(error);
  }
}

void LihuiyuCore::link_lost(const Error& error, TimePoint now) {
  now_ = now;
  switch (phase_) {
    case Phase::kClosed:
      return;
    case Phase::kJob:
      end_job(error);
      break;
    case Phase::kConfiguring:
    case Phase::kConnecting:
    case Phase::kHoming:
      fail(error);
      break;
    case Phase::kResetting:
      if (home_wanted_) {
        fail(error);
        break;
      }
      [[fallthrough]];
    case Phase::kReady:
      drop_out(error, false);
  }
  enter(Phase::kClosed);
}

// ---- time

void LihuiyuCore::tick(TimePoint now) {
  now_ = now;
  if (phase_ == Phase::kClosed) return;
  if (deadline_ && now_ >= *deadline_) {
    deadline_.reset();
    on_deadline();
  }
  if (phase_ == Phase::kJob) check_hold();
  if (phase_ == Phase::kClosed || phase_ == Phase::kConfiguring) return;
  link_.tick(now_);
  listen();
}

void LihuiyuCore::on_deadline() {
  switch (phase_) {
    case Phase::kClosed:
    case Phase::kReady:
      return;
    case Phase::kConfiguring:
    case Phase::kConnecting:
      fail(link_.knows_board() && state_ == BoardState::kNoPower
               ? Error{ErrorCode::kUnavailable, "the laser board has no power: switch the laser's own supply on"}
               : Error{ErrorCode::kTimeout,
                       "no Lihuiyu board answers on the laser's port: check the laser's supply and the USB cable"});
      close_ = true;
      return enter(Phase::kClosed);
    case Phase::kResetting:
      if (link_.sending()) return;
      return link_.send(reset_packet(), true, true, now_);
    case Phase::kHoming:
      fail({ErrorCode::kTimeout, "the laser did not finish homing in time"});
      return reset_board();
    case Phase::kJob:
      if (awaiting_end_)
        emergency(
            {ErrorCode::kDeviceFault,
             "the laser board does not report the end of its program: switch the laser off and on, then home it"});
      return;
  }
}

TimePoint LihuiyuCore::next_deadline() const {
  if (phase_ == Phase::kClosed) return TimePoint::max();
  TimePoint next = deadline_.value_or(TimePoint::max());
  if (phase_ == Phase::kConfiguring) return next;
  if (phase_ == Phase::kJob && hold_ == Hold::kRequested) next = std::min(next, std::max(still_at_, now_));
  return std::min(next, link_.next_deadline());
}

// ---- getting ready

void LihuiyuCore::enter(Phase phase) {
  phase_ = phase;
  deadline_.reset();
  const bool rests = phase == Phase::kReady;
  link_.poll_every(rests ? options_.rest_poll_period : options_.poll_period, now_);
}

void LihuiyuCore::finish_connect() {
  enter(Phase::kReady);
  const LaserLimits limits{{point<MachineFrame>(0, 0), point<MachineFrame>(options_.travel_x_mm, options_.travel_y_mm)},
                           status().firmware};
  events_.emplace_back(laser_event::Connected{limits});
}

void LihuiyuCore::begin_homing() {
  homed_ = false;
  homing_sent_ = false;
  quiet_statuses_ = 0;
  enter(Phase::kHoming);
  deadline_ = now_ + options_.homing_timeout;
  link_.drain();
  link_.send(home_packet(), true, false, now_);
}

void LihuiyuCore::reset_board() {
  homed_ = false;
  urgent_ = reset_packet();
  requests_.clear();
  enter(Phase::kResetting);
  // What was under way is given up. The urgent packet is not answered; another one is, and proves the reset.
  link_.restart(now_, false);
  link_.send(reset_packet(), true, true, now_);
}

void LihuiyuCore::fail(Error error) {
  home_wanted_ = false;
  events_.emplace_back(laser_event::Failed{std::move(error)});
}

void LihuiyuCore::drop_out(Error error, bool connected) {
  homed_ = false;
  events_.emplace_back(laser_event::Fault{std::move(error), connected});
}

// ---- what goes out

LihuiyuOutput LihuiyuCore::take_output() {
  LihuiyuOutput output;
  output.urgent = std::exchange(urgent_, {});
  output.requests = std::exchange(requests_, {});
  if (phase_ != Phase::kClosed && phase_ != Phase::kConfiguring)
    for (UsbRequest& request : link_.take_requests()) output.requests.push_back(std::move(request));
  output.close = std::exchange(close_, false);
  return output;
}

std::vector<LaserEvent> LihuiyuCore::take_events() { return std::exchange(events_, {}); }

LaserStatus LihuiyuCore::status() const {
  LaserStatus status;
  status.firmware = options_.board == Board::kM3 ? "Lihuiyu M3-Nano" : "Lihuiyu M2-Nano";
  status.connected = phase_ != Phase::kClosed && phase_ != Phase::kConfiguring && phase_ != Phase::kConnecting;
  if (!status.connected) return status;
  switch (state_) {
    case BoardState::kReady:
      status.state = phase_ == Phase::kJob ? "Run" : "Ready";
      break;
    case BoardState::kBusy:
      status.state = "Busy";
      break;
    case BoardState::kRejected:
      status.state = "Rejected";
      break;
    case BoardState::kFinished:
      status.state = "Finished";
      break;
    case BoardState::kNoPower:
      status.state = "No power";
      break;
  }
  if (hold_ == Hold::kHeld && phase_ == Phase::kJob) status.state = "Held";
  status.position = grid_.from_board(run_ ? run_->at() : at_);
  // The board does not say; while a program burns it must be supposed.
  status.beam_on = phase_ == Phase::kJob && program_begin_ && hold_ != Hold::kHeld;
  status.homed = homed_;
  return status;
}

}  // namespace veneer::lihuiyu
