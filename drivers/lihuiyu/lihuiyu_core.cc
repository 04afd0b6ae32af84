#include "drivers/lihuiyu/lihuiyu_core.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace veneer::lihuiyu {
namespace {

std::string word_of(BoardState state, bool job_running) {
  switch (state) {
    case BoardState::kReady:
      return job_running ? "Run" : "Ready";
    case BoardState::kBusy:
      return "Busy";
    case BoardState::kRejected:
      return "Rejected";
    case BoardState::kFinished:
      return "Finished";
    case BoardState::kNoPower:
      return "No power";
  }
  return {};
}

}  // namespace

LihuiyuOptions LihuiyuOptions::for_time_scale(double scale) {
  LihuiyuOptions options;
  if (!(scale > 1)) return options;
  for (Duration* limit : {&options.connect_timeout, &options.silence_timeout, &options.busy_timeout,
                          &options.finish_timeout, &options.reset_retry, &options.homing_timeout})
    *limit = Duration(std::llround(static_cast<double>(limit->count()) * scale));
  return options;
}

LihuiyuOptions LihuiyuOptions::for_recording() {
  LihuiyuOptions options;
  options.homing_wait = Duration(0);
  options.earliest_share = 0;
  options.recording = true;
  return options;
}

LihuiyuCore::LihuiyuCore(const LihuiyuOptions& options) : machine_(options), phase_(closed(machine_, *this)) {}

void LihuiyuCore::connect(TimePoint now) {
  at(now);
  enter(configuring(machine_, *this));
}

Phase& LihuiyuCore::at(TimePoint now) {
  machine_.now = now;
  over_.clear();
  return *phase_;
}

void LihuiyuCore::enter(std::unique_ptr<Phase> next) {
  over_.push_back(std::exchange(phase_, std::move(next)));
  machine_.link.poll_every(phase_->poll_period(), machine_.now);
  phase_->entered();
}

void LihuiyuCore::tell(LaserEvent event) { events_.push_back(std::move(event)); }

void LihuiyuCore::replied(const UsbReply& reply, TimePoint now) {
  if (at(now).replied(reply) || !phase_->uses_link()) return;
  machine_.link.replied(reply, now);
  listen();
}

void LihuiyuCore::listen() {
  PacketLink& link = machine_.link;
  const auto state = link.take_state();
  if (link.take_accepted()) phase_->accepted();
  if (state) {
    machine_.state = *state;
    phase_->told(*state);
  }
  if (const auto failure = link.take_failure()) phase_->link_failed(*failure);
}

void LihuiyuCore::tick(TimePoint now) {
  at(now).serve_deadline();
  phase_->tick();
  if (!phase_->uses_link()) return;
  machine_.link.tick(now);
  listen();
}

TimePoint LihuiyuCore::next_deadline() const {
  const TimePoint next = phase_->next_deadline();
  return phase_->uses_link() ? std::min(next, machine_.link.next_deadline()) : next;
}

LihuiyuOutput LihuiyuCore::take_output() {
  LihuiyuOutput output = std::exchange(machine_.output, {});
  if (phase_->uses_link())
    for (UsbRequest& request : machine_.link.take_requests()) output.requests.push_back(std::move(request));
  return output;
}

std::vector<LaserEvent> LihuiyuCore::take_events() { return std::exchange(events_, {}); }

LaserStatus LihuiyuCore::status() const {
  LaserStatus status;
  status.firmware = firmware_of(machine_.options.board);
  status.connected = phase_->connected();
  if (!status.connected) return status;
  status.state = phase_->held() ? "Held" : word_of(machine_.state, phase_->job_running());
  status.position = machine_.grid.from_board(phase_->at());
  status.beam_on = phase_->beam_supposed_on();
  status.homed = machine_.homed;
  return status;
}

}  // namespace veneer::lihuiyu
