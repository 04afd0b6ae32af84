#include "daemon/job_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "daemon/calibration.h"

namespace veneer::daemon {

JobRunner::JobRunner(boost::asio::io_context& reactor, LaserDriver& laser, DatabaseThread& database,
                     RunSupport& support, RunnerOptions options, Logger log, std::function<void()> on_change)
    : reactor_(reactor),
      laser_(laser),
      database_(database),
      support_(support),
      options_(std::move(options)),
      log_(std::move(log)),
      on_change_(std::move(on_change)),
      epoch_(std::make_shared<std::int64_t>(0)) {}

JobRunner::~JobRunner() {
  *epoch_ = -1;
  if (laser_connected_) laser_.abort();
}

void JobRunner::begin(const db::Recovery& recovery) {
  if (recovery.aborted_jobs.empty() && recovery.suspects.empty()) return;
  view_.state = CellState::kAborted;
  view_.reason = fmt::format(
      "the cell stopped in the middle of job {}: {} piece(s) are suspect; look at the panel, then Clear and Reset",
      recovery.aborted_jobs.empty() ? 0 : recovery.aborted_jobs.front().value, recovery.suspects.size());
}

void JobRunner::enter(CellState state, std::string reason) {
  log_->info("{} -> {}{}{}", to_string(view_.state), to_string(state), reason.empty() ? "" : ": ", reason);
  view_.state = state;
  view_.reason = std::move(reason);
  if (state != CellState::kSuspended) view_.load.reset(), seen_.reset(), drawn_.reset();
  on_change_();
}

Status JobRunner::refuse(CellCommand command) const {
  return Error{ErrorCode::kConflict, fmt::format("{} is not possible while the cell is {}{}", to_string(command),
                                                 to_string(view_.state), [&] {
                                                   switch (view_.state) {
                                                     case CellState::kAborted:
                                                       return ": Clear it first, then Reset";
                                                     case CellState::kStopped:
                                                     case CellState::kComplete:
                                                       return ": Reset it first";
                                                     case CellState::kHeld:
                                                       return ": Unhold, Stop or Abort";
                                                     case CellState::kSuspended:
                                                       return ": Unsuspend, Stop or Abort";
                                                     default:
                                                       return "";
                                                   }
                                                 }())};
}

void JobRunner::audit(const std::string& who, const std::string& what, const std::string& detail) {
  database_.async([entry = db::AuditEntry{0, utc_timestamp(), who, what, detail}](
                      Repositories& r) { return r.audit.append(entry); },
                  [log = log_](const Status& written) {
                    if (!written) log->error("the audit log could not be written: {}", written.error().message);
                  });
}

void JobRunner::answer(const Status& status) {
  if (pending_) std::exchange(pending_, nullptr)(status);
}

bool JobRunner::laser_busy() const { return pattern_reply_ || frame_reply_ || recut_ || (run_ && run_->burning); }

bool JobRunner::lid_was_opened() const { return laser_.status().state.rfind("Door", 0) == 0; }

// ---- Commands ----------------------------------------------------------------------------------------------------

void JobRunner::command(CellCommand command, const std::string& who, Reply reply, std::vector<std::string> confirmed) {
  if (command == CellCommand::kAbort) {
    abort(fmt::format("STOP by {}", who));
    audit(who, "cell.abort");
    return reply(Ok());
  }
  if (!after(view_.state, command)) return reply(refuse(command));
  audit(who, fmt::format("cell.{}", to_string(command)), fmt::format("{}", fmt::join(confirmed, ", ")));
  switch (command) {
    case CellCommand::kReset:
      return reset(std::move(reply));
    case CellCommand::kHold:
      return hold(std::move(reply));
    case CellCommand::kUnhold:
      return unhold(std::move(reply));
    case CellCommand::kUnsuspend:
      return unsuspend(std::move(reply), confirmed);
    case CellCommand::kStop:
      return stop(reply);
    case CellCommand::kClear:
      return clear(std::move(reply));
    default:
      return reply(refuse(command));  // Start and Recut name things; Suspend and Complete come from the work
  }
}

void JobRunner::reset(Reply reply) {
  enter(CellState::kResetting, "homing the laser");
  view_.job.reset();
  forget_cuts();
  pending_ = std::move(reply);
  if (laser_connected_)
    laser_.home();
  else
    laser_.connect([this, epoch = epoch_](const LaserEvent& event) {
      if (*epoch >= 0) on_laser(event);
    });
}

void JobRunner::clear(Reply reply) {
  const std::string reason = view_.reason;
  enter(CellState::kClearing);
  pending_ = std::move(reply);
  const auto cleared = [this] {
    enter(CellState::kStopped, "Reset homes the laser");
    answer(Ok());
  };
  if (!unwritten_) return cleared();
  write_end(*unwritten_, [this, reason, cleared](const Status& written) {
    if (written) return refresh_job(cleared);
    enter(CellState::kAborted, reason);
    answer(written);
  });
}

void JobRunner::start_job(JobId job, const std::string& who, Reply reply) {
  if (!after(view_.state, CellCommand::kStart)) return reply(refuse(CellCommand::kStart));
  if (!limits_.finds_home)
    return reply(Error{ErrorCode::kRefused,
                       "the laser does not find its corner by itself, so nothing says where the panel lies for it: fit "
                       "homing switches and switch homing on ($22=1)"});
  audit(who, "job.start", std::to_string(job.value));
  enter(CellState::kStarting);
  pending_ = std::move(reply);
  struct Loaded {
    db::JobRecord record;
    std::vector<db::PieceRecord> pieces;
  };
  const auto load = [job](Repositories& r) -> Result<Loaded> {
    auto calibration = load_calibration(r, utc_timestamp());
    if (!calibration) return calibration.error();
    if (const Status ready = require_cutting(*calibration); !ready) return ready.error();
    auto record = r.jobs.find(job);
    if (!record) return record.error();
    auto pieces = r.jobs.pieces(job);
    if (!pieces) return pieces.error();
    return Loaded{std::move(*record), std::move(*pieces)};
  };
  database_.async(
      load, while_current([this, job](Result<Loaded> loaded) {
        if (!loaded) {
          enter(CellState::kIdle);
          return answer(loaded.error());
        }
        to_cut_.clear();
        for (auto& piece : loaded->pieces)
          if (piece.state == db::PieceState::kReserved) to_cut_.push_back(std::move(piece));
        if (to_cut_.empty()) {
          enter(CellState::kIdle);
          return answer(Error{ErrorCode::kConflict, fmt::format("job {} has no piece left to cut", job.value)});
        }
        std::stable_sort(to_cut_.begin(), to_cut_.end(),
                         [](const auto& a, const auto& b) { return a.panel->value < b.panel->value; });
        view_.job = JobView{job, loaded->record.name, 0, 0, 0, {}, 0};
        support_.plan_setups(to_cut_, limits_.travel, while_current([this](Result<std::vector<RunSetup>> setups) {
                               if (!setups) {
                                 enter(CellState::kIdle);
                                 return answer(setups.error());
                               }
                               setups_.assign(setups->begin(), setups->end());
                               refresh_job([this] {
                                 enter(CellState::kSuspending);
                                 await_panel();
                                 answer(Ok());
                               });
                             }));
      }));
}

void JobRunner::hold(Reply reply) {
  enter(CellState::kHolding);
  if (laser_busy()) {
    pending_ = std::move(reply);
    return laser_.hold();
  }
  // Between two pieces: the next one waits.
  if (run_) run_->hold_wanted = true;
  enter(CellState::kHeld, "held between two pieces");
  reply(Ok());
}

void JobRunner::unhold(Reply reply) {
  if (laser_busy()) {
    enter(CellState::kUnholding);
    pending_ = std::move(reply);
    return laser_.resume();
  }
  if (const Status ready = check_machine(laser_.status()); !ready) return reply(ready);
  enter(CellState::kUnholding);
  enter(CellState::kExecute);
  reply(Ok());
  if (!run_) return;
  run_->consented = true;
  if (std::exchange(run_->hold_wanted, false)) next_piece();
}

void JobRunner::stop(const Reply& reply) {
  const CellState from = view_.state;
  if (from == CellState::kExecute && run_) {
    run_->stop_after_piece = true;
    enter(CellState::kStopping, "finishing the piece that is being cut");
    return reply(Ok());
  }
  // A piece that was begun cannot be finished without motion, and a run that is being prepared may be in the database
  // already: both end as an abort.
  if (laser_busy() || (run_ && run_->noted) || from == CellState::kUnsuspending || from == CellState::kResetting) {
    abort("stopped by the operator");
    return reply(Ok());
  }
  enter(CellState::kStopping);
  answer(Error{ErrorCode::kCancelled, "stopped by the operator"});
  if (run_) {
    run_->stop_after_piece = true;
    end_run();
  } else {
    ++*epoch_;
    looking_ = false;
    stop_waiting_job();
    enter(CellState::kStopped);
  }
  reply(Ok());
}

void JobRunner::stop_after_piece(const std::string& who, const Reply& reply) {
  if (!run_ || view_.state != CellState::kExecute)
    return reply(Error{ErrorCode::kConflict, "no piece is being cut: nothing to stop after"});
  audit(who, "cell.stop-after-piece");
  run_->stop_after_piece = true;
  view_.reason = "stopping after this piece";
  on_change_();
  reply(Ok());
}

void JobRunner::burn_pattern(LaserJob strokes, const std::string& who, Reply reply,
                             std::vector<std::string> confirmed) {
  if (view_.state != CellState::kIdle || pattern_reply_) return reply(refuse(CellCommand::kStart));
  const bool burns = std::any_of(strokes.strokes.begin(), strokes.strokes.end(),
                                 [](const Stroke& stroke) { return stroke.power > PowerFraction(0); });
  if (const Status given = burns ? require_confirmed(confirmed) : Ok(); !given) return reply(given);
  const PieceBurn all{{}, {}, std::move(strokes), 0};
  if (const Status checked = check({&all, 1}); !checked) return reply(checked);
  audit(who, "laser.pattern", fmt::format("{}", fmt::join(confirmed, ", ")));
  pattern_reply_ = std::move(reply);
  enter(CellState::kExecute, "burning the calibration pattern");
  laser_.start(all.strokes);
}

void JobRunner::check_pattern(LaserJob strokes, const std::string& who, Reply reply) {
  if (view_.state != CellState::kIdle || pattern_reply_) return reply(refuse(CellCommand::kStart));
  audit(who, "laser.check");
  if (const Status taken = laser_.check(std::move(strokes)); !taken) return reply(taken);
  pattern_reply_ = std::move(reply);
}

Status JobRunner::jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who) {
  if (view_.state != CellState::kIdle)
    return Error{ErrorCode::kConflict,
                 fmt::format("the laser is jogged while the cell is Idle, now it is {}", to_string(view_.state))};
  audit(who, "laser.jog", fmt::format("{:.3f} {:.3f} mm", dx.count(), dy.count()));
  return laser_.jog(dx, dy, speed);
}

void JobRunner::abort(const std::string& reason) noexcept {
  laser_.abort();
  break_off(reason, {});
}

// Everything that was going on ends here, with the beam already off.
void JobRunner::break_off(const std::string& reason, std::vector<PieceId> suspects) {
  if (!after(view_.state, CellCommand::kAbort)) return;
  ++*epoch_;
  looking_ = false;
  std::string why_aborted = reason;
  if (recut_ && recut_->next > 0)
    why_aborted += fmt::format("; piece {} was being cut again: look at it", recut_->burns[recut_->next - 1].mark);
  enter(CellState::kAborting, why_aborted);
  const Error why{ErrorCode::kCancelled, why_aborted};
  answer(why);
  if (pattern_reply_) std::exchange(pattern_reply_, nullptr)(why);
  if (frame_reply_) std::exchange(frame_reply_, nullptr)(why);
  view_.framing = false;
  recut_.reset();
  forget_cuts();
  const auto finish = [this, reason = why_aborted] {
    run_.reset();
    refresh_job([this, reason] {
      enter(
          CellState::kAborted,
          unwritten_ ? reason + "; the end of the run is not written yet: make room on the disk, then Clear" : reason);
    });
  };
  if (run_) {
    write_end({run_->id, std::move(suspects), run_->unbooked, reason}, [finish](const Status&) { finish(); });
  } else if (view_.job && !to_cut_.empty()) {
    database_.async([job = view_.job->id](Repositories& r) { return r.jobs.abort_job(job, utc_timestamp()); },
                    while_current([finish](const Status&) { finish(); }));  // a planned job stays planned
  } else {
    finish();
  }
}

// A piece that was proven is booked all the same. What the disk does not take is kept for the next Clear: without its
// end no run could begin after this one until the daemon is restarted. It is kept until it is known to be written, for
// a STOP may come between (writing it twice changes nothing).
void JobRunner::write_end(BrokenRun run, std::function<void(Status)> then) {
  const auto disk_failed = [](const Status& s) { return !s && s.error().code == ErrorCode::kStorage; };
  unwritten_ = run;
  database_.async(
      [run = std::move(run), disk_failed](Repositories& r) -> Status {
        if (run.verified)
          if (Status booked = r.jobs.book_piece(*run.verified, utc_timestamp()); disk_failed(booked)) return booked;
        return r.jobs.abort_run(run.id, run.suspects, run.reason, utc_timestamp());
      },
      while_current([this, disk_failed, then = std::move(then)](const Status& written) {
        if (!written) log_->error("the end of the run could not be written: {}", written.error().message);
        if (disk_failed(written))
          return then(Error{ErrorCode::kStorage,
                            fmt::format("the end of the run is not written yet: {}", written.error().message)});
        unwritten_.reset();
        then(Ok());
      }));
}

void JobRunner::stop_waiting_job() {
  if (!view_.job) return;
  database_.async([job = view_.job->id](Repositories& r) { return r.jobs.stop_job(job, utc_timestamp()); },
                  // A job that never ran stays planned, which the store says by refusing; that is no fault.
                  [log = log_](const Status& ended) {
                    if (!ended) log->debug("{}", ended.error().message);
                  });
}

void JobRunner::refresh_job(std::function<void()> then) {
  if (!view_.job) return then();
  database_.async([job = view_.job->id](Repositories& r) { return r.jobs.find(job); },
                  while_current([this, then = std::move(then)](Result<db::JobRecord> record) {
                    if (record && view_.job) {
                      JobView& job = *view_.job;
                      job.pieces = 0;
                      for (const auto& [state, count] : record->pieces)
                        if (state != db::PieceState::kUnfilled && state != db::PieceState::kReleased)
                          job.pieces += count;
                      job.cut = record->count(db::PieceState::kCut);
                      job.suspect = record->count(db::PieceState::kSuspect);
                      job.current_piece.clear();
                      job.eta_seconds = 0;
                    }
                    then();
                  }));
}

}  // namespace veneer::daemon
