// The part of LihuiyuCore that runs a job.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "drivers/lihuiyu/lihuiyu_core.h"

namespace veneer::lihuiyu {
namespace {

Duration seconds(double s) { return Duration(std::llround(s * 1e9)); }

}  // namespace

void LihuiyuCore::pump() {
  if (phase_ != Phase::kJob || hold_ != Hold::kNone || link_.sending() || awaiting_end_) return;
  if (run_->first_of_program()) link_.drain();
  // Counted from here, so that the motion can only have begun later.
  if (!program_begin_) program_begin_ = now_;
  run_->sending();
  link_.send(run_->packet(), run_->may_finish(), false, now_);
}

void LihuiyuCore::packet_accepted() {
  double slowest_s = options_.packet_motion_s / options_.slowest_share;
  if (run_->first_of_program()) {
    // The dark way is somewhere in the first packets.
    const MilPoint from = run_->program().begin, to = run_->program().start;
    const double dark_mm = kMillimetresPerMil * static_cast<double>(std::abs(to.x - from.x) + std::abs(to.y - from.y));
    slowest_s += 1 + dark_mm / options_.slowest_rapid_mm_s;
  }
  still_at_ = std::max(still_at_, now_) + seconds(slowest_s);
  run_->accepted();
  if (run_->all_sent()) {
    awaiting_end_ = true;
    deadline_ = std::max(still_at_, now_) + options_.finish_timeout;
  }
  check_hold();
  pump();
}

void LihuiyuCore::on_job_state(BoardState state) {
  if (link_.sending()) return;
  switch (state) {
    case BoardState::kNoPower:
      return emergency({ErrorCode::kDeviceFault,
                        "the laser board lost its power: check the lid, the emergency stop and the laser's supply"});
    case BoardState::kFinished:
      if (awaiting_end_) program_ended();
      return;
    case BoardState::kRejected:
    case BoardState::kReady:
    case BoardState::kBusy:
      return;
  }
}

void LihuiyuCore::program_ended() {
  const double lasted_s = std::chrono::duration<double>(now_ - *program_begin_).count();
  const double shortest_s = options_.earliest_share * run_->program().shortest_s;
  if (lasted_s < shortest_s)
    return emergency({ErrorCode::kDeviceFault,
                      fmt::format("the laser board reports the end of a program after {:.1f} s that lasts at least "
                                  "{:.1f} s: it has not executed all of it",
                                  lasted_s, shortest_s)});
  awaiting_end_ = false;
  deadline_.reset();
  program_begin_.reset();
  still_at_ = now_;
  const Program& program = run_->program();
  for (std::size_t i = 0; i < program.stroke_count; ++i)
    events_.emplace_back(laser_event::StrokeExecuted{program.first_stroke + i});
  if (const auto piece = run_->program_ended()) events_.emplace_back(laser_event::PieceVerified{*piece});
  if (!run_->finished()) {
    check_hold();
    return pump();
  }
  const bool stopped_early = run_->stopped_early();
  at_ = run_->at();
  run_.reset();
  hold_ = Hold::kNone;
  enter(Phase::kReady);
  events_.emplace_back(laser_event::Done{stopped_early});
}

// Held once nothing is on its way and the slowest board has burnt what it holds.
void LihuiyuCore::check_hold() {
  if (phase_ != Phase::kJob || hold_ != Hold::kRequested || link_.sending() || now_ < still_at_) return;
  hold_ = Hold::kHeld;
  held_since_ = now_;
  // Nothing moves, so the end may only come if it was reached already.
  deadline_.reset();
  events_.emplace_back(laser_event::Held{});
}

void LihuiyuCore::emergency(const Error& error) {
  reset_board();
  end_job(error);
}

void LihuiyuCore::end_job(const Error& error) {
  if (!run_) return;
  laser_event::Aborted aborted{error, run_->suspect(), true};
  run_.reset();
  hold_ = Hold::kNone;
  homed_ = false;
  program_begin_.reset();
  events_.emplace_back(std::move(aborted));
}

}  // namespace veneer::lihuiyu
