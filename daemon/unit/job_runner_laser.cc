// What the laser says, and what the unit makes of it.
#include <fmt/format.h>

#include <utility>

#include "base/clock.h"
#include "daemon/unit/job_runner.h"

namespace veneer::daemon {
namespace {

// Who was told to resume, and says that it is held.
std::string why_still_held(const LaserStatus& laser) {
  if (lid_is_open(laser))
    return "the machine stays held: close the lid, then Unhold" +
           (laser.refusal.empty() ? std::string() : "; and " + laser.refusal);
  if (!laser.refusal.empty()) return "the machine stays held: " + laser.refusal;
  return "the machine stays held and does not say why: look at its switches and its display, then Unhold";
}

}  // namespace

void JobRunner::on_laser(const LaserEvent& event) {
  using namespace laser_event;
  if (const auto* connected = std::get_if<Connected>(&event)) {
    laser_connected_ = true;
    limits_ = connected->limits;
    recuts_.laser_connected();
    // A file that stands for a machine is none.
    if (limits_.burns)
      parts().database.async(
          [identity = limits_.identity](Repositories& r) { return r.certificates.laser_is(identity, utc_timestamp()); },
          [log = log_](const Status& known) {
            if (!known) log->error("which laser is there could not be written: {}", known.error().message);
          });
    if (view_.state == CellState::kResetting && homing_) parts().laser.home();
  } else if (const auto* failed = std::get_if<Failed>(&event)) {
    on_failed(failed->error);
  } else if (std::holds_alternative<Homed>(event)) {
    if (view_.state != CellState::kResetting) return;
    proof_.homed_at(parts().laser.status().position);
    jogging_.forget();
    record_.end_all();
    // Idle is told when it is written that the cell rests, so that a kill after that finds it so.
    parts().database.async([](Repositories&) { return 0; }, while_current([this](int) {
                             enter(CellState::kIdle);
                             answer(Ok());
                           }));
  } else if (std::holds_alternative<Held>(event)) {
    on_held();
  } else if (std::holds_alternative<Resumed>(event)) {
    on_resumed();
  } else if (const auto* done = std::get_if<Done>(&event)) {
    on_done(done->remark);
  } else if (std::holds_alternative<Checked>(event)) {
    if (check_reply_) std::exchange(check_reply_, nullptr)(Ok());
  } else if (const auto* jogged = std::get_if<JogEnded>(&event)) {
    on_jog_ended(*jogged);
  } else if (const auto* fault = std::get_if<Fault>(&event)) {
    laser_connected_ = fault->connected;
    break_off(fault->error.message, nullptr);
  } else if (const auto* aborted = std::get_if<Aborted>(&event)) {
    if (aborted->error.code == ErrorCode::kDisconnected) laser_connected_ = false;
    if (owed_end_.take(*aborted)) return;
    break_off(aborted->error.message, aborted);
  }
}

void JobRunner::on_failed(const Error& error) {
  if (error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kDisconnected ||
      error.code == ErrorCode::kTimeout)
    laser_connected_ = false;
  if (check_reply_ && laser_connected_) return std::exchange(check_reply_, nullptr)(error);
  if (at_laser_ && laser_connected_) {
    at_laser_ = laser_held_ = false;
    if (!activity_->not_begun()) return refused(error);
    // A curable fault, or the operator's Hold before it had begun.
    const bool by_operator = view_.state == CellState::kHolding;
    rest(by_operator ? "held before the next piece" : error.message);
    return answer(by_operator ? Ok() : Status(error));
  }
  answer(error);
  break_off(error.message, nullptr);
}

void JobRunner::on_held() {
  if (!at_laser_) return;  // it has told the end of its strokes before: the unit rests by itself
  if (is_aside())
    return abort(fmt::format("the lid was opened while {}: close it, then Clear and Reset", activity_->doing()));
  const bool told_before = std::exchange(laser_held_, true);
  switch (view_.state) {
    case CellState::kHolding:
      enter(CellState::kHeld, "held by the operator");
      return answer(Ok());
    case CellState::kUnholding:
      if (told_before) return;
      enter(CellState::kHeld, why_still_held(parts().laser.status()));
      return answer(Error{ErrorCode::kRefused, view_.reason});
    case CellState::kExecute:
    case CellState::kStopping:
      return enter(CellState::kHeld, "held by the machine: check the lid, then Unhold");
    default:
      return;
  }
}

void JobRunner::on_resumed() {
  if (view_.state != CellState::kUnholding || !at_laser_) return;
  enter(CellState::kExecute);
  answer(Ok());
}

void JobRunner::on_done(const std::string& remark) {
  if (!at_laser_) return;
  at_laser_ = laser_held_ = false;
  proof_.piece_burnt(*activity_);
  if (view_.state == CellState::kHolding) {
    enter(CellState::kHeld, "held between two pieces");
    answer(Ok());
  } else if (view_.state == CellState::kUnholding && !proof_.under_way()) {
    enter(CellState::kExecute);
    answer(Ok());
  }
  activity_->burnt(remark);
}

void JobRunner::on_jog_ended(const laser_event::JogEnded& jog) {
  // A jog that ended in a reset has lost the position. Aborted, it was sought by hand, and nothing more is broken off.
  if (jog.error && !parts().laser.status().homed && after(view_.state, CellCommand::kAbort))
    return break_off(jog.error->message, nullptr);
  jogging_.ended();
  if (proof_.jog_ended()) return;
  if (view_.state != CellState::kHolding || at_laser_) return;
  enter(CellState::kHeld, "held between two pieces");
  answer(Ok());
}

}  // namespace veneer::daemon
