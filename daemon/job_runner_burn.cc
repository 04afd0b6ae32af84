// The runner's way with the laser: pieces one after the other, and what the machine says of them.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/job_runner.h"

namespace veneer::daemon {

void JobRunner::begin_run(const ProvenPose& pose) {
  support_.prepare(pose, setup_pieces(), limits_.motion,
                   while_current([this, pose](Result<std::vector<PieceBurn>> burns) {
                     if (burns) return run_prepared(pose, std::move(*burns));
                     await_panel();
                     answer(burns.error());
                   }));
}

void JobRunner::run_prepared(const ProvenPose& pose, std::vector<PieceBurn> burns) {
  if (const Status checked = check(burns); !checked) {
    await_panel();
    return answer(checked);
  }
  database_.async(
      [job = view_.job->id, pose](Repositories& r) {
        return r.jobs.start_run(job, pose.panel, pose.bed_from_panel, pose.rms, utc_timestamp());
      },
      [this, epoch = epoch_, at = *epoch_, pose, burns = std::move(burns)](Result<db::RunId> run) mutable {
        if (*epoch < 0) return;
        if (*epoch != at) {  // broken off meanwhile: nothing of it was cut
          if (run)
            database_.async(
                [id = *run](Repositories& r) {
                  return r.jobs.abort_run(id, {}, "broken off before the first piece", utc_timestamp());
                },
                [](const Status&) {});
          return;
        }
        if (!run) {
          await_panel();
          return answer(run.error());
        }
        run_ = std::make_unique<PanelRun>();
        run_->id = *run;
        run_->panel = pose.panel;
        kept_ = KeptCuts{pose, {}};
        run_->burns = std::move(burns);
        run_->consented = true;
        enter(CellState::kExecute);
        answer(Ok());
        next_piece();
      });
}

void JobRunner::next_piece() {
  if (run_->hold_wanted) return;  // unhold() comes back here
  if (run_->noted) return burn_noted_piece();
  if (run_->next == run_->burns.size() || run_->stop_after_piece) return end_run();
  const PieceId piece = run_->burns[run_->next].piece;
  database_.async([piece](Repositories& r) { return r.jobs.mark_cutting(piece, utc_timestamp()); },
                  while_current([this](const Status& marked) {
                    if (!marked)
                      return abort(fmt::format("the next piece could not be noted ({}): nothing of it was cut",
                                               marked.error().message));
                    run_->noted = true;
                    if (!run_->hold_wanted) burn_noted_piece();
                  }));
}

// Nothing moves after a lid that was closed until the operator says so, be it open for an instant between two pieces.
void JobRunner::burn_noted_piece() {
  if (!std::exchange(run_->consented, false) && lid_was_opened()) {
    run_->hold_wanted = true;
    enter(CellState::kHolding);
    return enter(CellState::kHeld, "the lid was opened between two pieces: close it, then Unhold");
  }
  const PieceBurn& burn = run_->burns[run_->next++];
  run_->noted = false;
  run_->burning = true;
  view_.job->current_piece = burn.mark;
  view_.job->eta_seconds = run_->seconds_left() + burn.seconds;
  on_change_();
  laser_.start(burn.strokes);
}

void JobRunner::piece_verified() {
  const PieceId piece = run_->burns[run_->next - 1].piece;
  run_->burning = false;
  run_->unbooked = piece;
  keep_cuts(run_->burns[run_->next - 1]);
  database_.async([piece](Repositories& r) { return r.jobs.book_piece(piece, utc_timestamp()); },
                  while_current([this, piece](const Status& booked) {
                    if (!booked)
                      return abort(fmt::format("a cut piece could not be booked: {}", booked.error().message));
                    run_->unbooked.reset();
                    std::erase_if(to_cut_, [piece](const auto& p) { return p.id == piece; });
                    ++view_.job->cut;
                    view_.job->current_piece.clear();
                    on_change_();
                    next_piece();
                  }));
}

void JobRunner::end_run() {
  const bool stopped = run_->stop_after_piece && run_->next < run_->burns.size();
  if (!stopped) setups_.pop_front();
  const bool more = !stopped && !setups_.empty();
  if (!stopped) enter(more ? CellState::kSuspending : CellState::kCompleting);
  database_.async([run = run_->id, more](Repositories& r) { return r.jobs.finish_run(run, more, utc_timestamp()); },
                  while_current([this, stopped, more](const Status& finished) {
                    if (!finished)
                      return abort(fmt::format("the run could not be closed: {}", finished.error().message));
                    run_.reset();
                    refresh_job([this, stopped, more] {
                      if (stopped)
                        return enter(CellState::kStopped,
                                     "stopped after a piece; Reset, then Start goes on with the rest");
                      if (more) return await_panel();
                      enter(CellState::kComplete, fmt::format("job {} is cut", view_.job ? view_.job->id.value : 0));
                    });
                  }));
}

// ---- The laser ---------------------------------------------------------------------------------------------------

void JobRunner::on_laser(const LaserEvent& event) {
  using namespace laser_event;
  if (const auto* connected = std::get_if<Connected>(&event)) {
    laser_connected_ = true;
    limits_ = connected->limits;
    if (view_.state == CellState::kResetting) laser_.home();
  } else if (const auto* failed = std::get_if<Failed>(&event)) {
    on_failed(failed->error);
  } else if (std::holds_alternative<Homed>(event)) {
    if (view_.state != CellState::kResetting) return;
    enter(CellState::kIdle);
    answer(Ok());
  } else if (std::holds_alternative<Held>(event)) {
    on_held();
  } else if (std::holds_alternative<Resumed>(event)) {
    on_resumed();
  } else if (std::holds_alternative<Done>(event)) {
    on_done();
  } else if (std::holds_alternative<Checked>(event)) {
    if (pattern_reply_) std::exchange(pattern_reply_, nullptr)(Ok());
  } else if (const auto* jogged = std::get_if<JogEnded>(&event)) {
    // A jog that ended in a reset has lost the position.
    if (jogged->error && !laser_.status().homed) break_off(jogged->error->message, {});
  } else if (const auto* fault = std::get_if<Fault>(&event)) {
    laser_connected_ = fault->connected;
    break_off(fault->error.message, {});
  } else if (const auto* aborted = std::get_if<Aborted>(&event)) {
    if (aborted->error.code == ErrorCode::kDisconnected) laser_connected_ = false;
    break_off(aborted->error.message, aborted->suspect);
  }
}

void JobRunner::on_failed(const Error& error) {
  if (error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kDisconnected ||
      error.code == ErrorCode::kTimeout)
    laser_connected_ = false;
  answer(error);
  if (pattern_reply_ && laser_connected_) {
    std::exchange(pattern_reply_, nullptr)(error);
    return enter(CellState::kIdle, error.message);
  }
  if (frame_reply_ && laser_connected_) {  // refused before it moved
    view_.framing = false;
    view_.reason = error.message;
    on_change_();
    return std::exchange(frame_reply_, nullptr)(error);
  }
  break_off(error.message, {});
}

void JobRunner::on_held() {
  if (view_.framing) return abort("the lid was opened while the frame was traced: close it, then Clear and Reset");
  switch (view_.state) {
    case CellState::kHolding:
      enter(CellState::kHeld, "held by the operator");
      return answer(Ok());
    case CellState::kUnholding:
      enter(CellState::kHeld, "the machine stays held: close the lid, then Unhold");
      return answer(Error{ErrorCode::kRefused, view_.reason});
    case CellState::kExecute:
    case CellState::kStopping:
      return enter(CellState::kHeld, "held by the machine: check the lid, then Unhold");
    default:
      return;
  }
}

void JobRunner::on_resumed() {
  if (view_.state != CellState::kUnholding) return;
  enter(CellState::kExecute);
  answer(Ok());
}

void JobRunner::on_done() {
  if (pattern_reply_) {
    enter(CellState::kCompleting);
    enter(CellState::kComplete, "the pattern is burnt");
    return std::exchange(pattern_reply_, nullptr)(Ok());
  }
  if (frame_reply_) {
    view_.framing = false;
    view_.reason = "the frame is traced";
    on_change_();
    return std::exchange(frame_reply_, nullptr)(Ok());
  }
  if (recut_) return next_recut();
  if (run_ && run_->burning) piece_verified();
}

}  // namespace veneer::daemon
