// The runner's commands: what the operator asks for, and the states in which it is taken.
#include "daemon/unit/job_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "base/journal.h"
#include "daemon/unit/confirmations.h"
#include "daemon/unit/frame_trace.h"
#include "daemon/unit/job_words.h"
#include "daemon/unit/open_job.h"
#include "daemon/unit/panel_run.h"
#include "daemon/unit/pattern_burn.h"
#include "daemon/unit/preflight.h"
#include "daemon/unit/recut.h"

namespace veneer::daemon {

JobRunner::JobRunner(boost::asio::io_context& reactor, const UnitParts& parts, RunnerOptions options, Logger log,
                     std::function<void()> on_change)
    : ActivityHost(parts),
      reactor_(reactor),
      options_(std::move(options)),
      log_(std::move(log)),
      audit_log_(parts.database, log_),
      on_change_(std::move(on_change)),
      wait_(
          parts.bed, parts.planner, [this](std::span<const PieceBurn> burns) { return check(burns); },
          [this] {
            view_.load = wait_.view();
            on_change_();
          }),
      proof_(*this, options_, log_),
      owed_(
          parts, log_,
          [this] {
            view_.owed_look = owed_.view();
            on_change_();
          },
          [this](JobId job, const std::string& why) { doubted(job, why); }),
      owed_end_(*this, log_),
      progress_(*this, view_, [this] { on_change_(); }),
      recuts_(
          parts.database, view_, log_, [this] { return laser_connected_ ? &limits_ : nullptr; },
          [this] { on_change_(); }),
      record_(parts.database),
      jogging_(
          {parts.laser, limits_, view_, options_.keep_out, epoch(), record_, audit_log_, [this] { owed_.disturb(); }}),
      overrides_(parts.laser, view_, [this] { on_change_(); }) {}

JobRunner::~JobRunner() {
  alive_.reset();
  if (laser_connected_) parts().laser.abort();
}

void JobRunner::begin(const db::Recovery& recovery) {
  recuts_.recall();
  parts().database.async([](Repositories& r) { return r.jobs.unproven(); },
                         [this, alive = std::weak_ptr<int>(alive_)](Result<std::optional<db::UnprovenCuts>> cuts) {
                           if (alive.expired()) return;
                           if (!cuts) return log_->warn("{}", cuts.error().message);
                           if (!*cuts) return;
                           owed_.owe(std::move(**cuts));  // it was to look again, whatever is configured since
                           if (may_look_for_owed()) owed_.look();
                         });
  if (!recovery.clear_owed) return;
  view_.state = CellState::kAborted;
  if (!recovery.aborted_jobs.empty()) progress_.refresh_rest(recovery.aborted_jobs.front());
  view_.reason = recovery_words(recovery);
}

void JobRunner::enter(CellState state, std::string reason) {
  const std::string piece = view_.job ? view_.job->current_piece : "";
  const LogAbout about(
      {view_.job ? std::to_string(view_.job->id.value) : "", view_.load ? view_.load->panel.value : "", piece, ""});
  log_->info("{} -> {}{}{}", to_string(view_.state), to_string(state), reason.empty() ? "" : ": ", reason);
  ++states_entered_;
  view_.state = state;
  view_.reason = std::move(reason);
  view_.only_stop = state == CellState::kHeld && activity_ && !activity_->still_wanted();
  overrides_.state_entered();
  if (state != CellState::kHolding && state != CellState::kHeld) view_.hold_commanded = false;
  // In these states an operator may reach in.
  if (state == CellState::kIdle || state == CellState::kSuspended || state == CellState::kHeld)
    parts().bed.hands_were_in();
  if (state != CellState::kSuspended) wait_.end(), view_.load.reset();
  on_change_();
  if (may_look_for_owed()) owed_.look();
}

void JobRunner::audit(const std::string& who, const std::string& what, const std::string& detail) {
  audit_log_.write({0, utc_timestamp(), who, what, detail});
}

void JobRunner::answer(const Status& status) {
  for (const Reply& reply : std::exchange(pending_, {}))
    if (reply) reply(status);
}

Status JobRunner::require_confirmed(const std::vector<std::string>& confirmed) const {
  std::vector<std::string> wanted = options_.confirm;
  wanted.insert(wanted.end(), limits_.to_confirm.begin(), limits_.to_confirm.end());
  return check_confirmed(wanted, confirmed);
}

void JobRunner::command(CellCommand command, const std::string& who, Reply reply, std::vector<std::string> confirmed) {
  if (command == CellCommand::kAbort) {
    stop_by([&who] { return who; });
    return reply(Ok());
  }
  if (command == CellCommand::kHold && is_aside()) return give_up_aside(who, reply);
  if (!after(view_.state, command)) return reply(refusal(view_.state, command));
  audit(who, fmt::format("cell.{}", to_string(command)), fmt::format("{}", fmt::join(confirmed, ", ")));
  switch (command) {
    case CellCommand::kReset:
      return reset(std::move(reply));
    case CellCommand::kHold:
      return hold(std::move(reply));
    case CellCommand::kUnhold:
      return unhold(std::move(reply));
    case CellCommand::kUnsuspend:
      return unsuspend(who, std::move(reply), confirmed);
    case CellCommand::kStop:
      return stop(who, reply);
    case CellCommand::kClear:
      return clear(who, std::move(reply));
    default:  // Start and Recut name things; Suspend and Complete come from the work
      return reply(refusal(view_.state, command));
  }
}

void JobRunner::stop_by(const std::function<std::string()>& who) {
  parts().laser.abort();  // the words, which take memory, come after
  stop_given_ = SteadyClock().now();
  const std::string name = who();
  break_off(fmt::format("STOP by {}", name), nullptr, false, name);
  audit_log_.write_or_count({0, utc_timestamp(), name, "cell.abort", {}});
}

void JobRunner::reset(Reply reply) {
  owed_.disturb();  // the head crosses the bed
  enter(CellState::kResetting, "homing the laser");
  view_.job.reset();
  pending_ = {std::move(reply)};
  homing_ = false;
  record_.begin(WorkRecord::Work::kHoming, "while the laser was homed",
                while_current([this, given = consent().lid_openings](const Status& written) {
                  if (const Status may = written ? check_lid_stayed(given, parts().laser.status()) : written; !may) {
                    record_.end(WorkRecord::Work::kHoming);
                    const Error why{may.error().code, fmt::format("the laser is not homed: {}", may.error().message)};
                    enter(CellState::kStopping);
                    enter(CellState::kStopped, why.message);
                    return answer(why);
                  }
                  homing_ = true;
                  if (laser_connected_) return parts().laser.home();
                  parts().laser.connect([this, alive = std::weak_ptr<int>(alive_)](const LaserEvent& event) {
                    if (!alive.expired()) on_laser(event);
                  });
                }));
}

void JobRunner::clear(const std::string& who, Reply reply) {
  const std::string reason = view_.reason;
  enter(CellState::kClearing);
  pending_ = {std::move(reply)};
  const auto cleared = [this, who] {
    parts().database.owe([who](Repositories& r) { return r.jobs.note_cleared(who, utc_timestamp()); });
    enter(CellState::kStopped, "Reset homes the laser");
    answer(Ok());
  };
  if (!owed_end_.unwritten()) return cleared();
  owed_end_.try_again([this, reason, cleared](const Result<int>& written) {
    if (!owed_end_.unwritten()) return progress_.refresh(cleared);
    enter(CellState::kAborted, reason);
    answer(written.error());
  });
}

void JobRunner::start_job(JobId job, const std::string& who, Reply reply) {
  if (!after(view_.state, CellCommand::kStart) || check_reply_) return reply(refusal(view_.state, CellCommand::kStart));
  if (const Status may = may_book(); !may) return reply(may);
  if (const Status may = check_cuts_stock(options_, limits_); !may) return reply(may);
  audit(who, "job.start", std::to_string(job.value));
  enter(CellState::kStarting);
  pending_ = {std::move(reply)};
  const auto give_up = [this](const Error& error) {
    record_.end(WorkRecord::Work::kJob);
    view_.job.reset();
    enter(CellState::kIdle);
    answer(error);
  };
  record_.begin(WorkRecord::Work::kJob, fmt::format("in the middle of job {}", job.value),
                while_current([this, job, give_up](const Status& written) {
                  written ? prepare_job(job, give_up) : give_up(written.error());
                }));
}

void JobRunner::prepare_job(JobId job, const std::function<void(const Error&)>& give_up) {
  parts().database.async([job](Repositories& r) { return load_open_job(r, job); },
                         while_current([this, job, give_up](const Result<OpenJob>& open) {
                           if (!open) return give_up(open.error());
                           view_.job = JobView{job, open->name, 0, 0, 0, {}, 0};
                           parts().planner.plan_setups(open->pieces, limits_.travel,
                                                       while_current([this, to_cut = open->pieces,
                                                                      give_up](Result<std::vector<RunSetup>> setups) {
                                                         if (!setups) return give_up(setups.error());
                                                         wait_.take_job(std::move(*setups), to_cut);
                                                         progress_.refresh([this] {
                                                           enter(CellState::kSuspending);
                                                           await_panel();
                                                           answer(Ok());
                                                         });
                                                       }));
                         }));
}

Status JobRunner::may_book() const { return parts().may_book ? parts().may_book() : Ok(); }

void JobRunner::await_panel() {
  enter(CellState::kSuspended);
  wait_.begin(limits_.motion);
}

void JobRunner::look_again() {
  if (may_look_for_owed()) owed_.look_now_and_then();
  if (view_.state == CellState::kSuspended && !activity_) wait_.look_again();
}

// The state itself is the memory of it: next() lets nothing through until Unhold.
void JobRunner::hold(Reply reply) {
  if (!activity_) return reply(refusal(view_.state, CellCommand::kHold));  // nothing will burn
  switch (view_.state) {
    case CellState::kHeld:
      return reply(Ok());
    case CellState::kHolding:
      pending_.push_back(std::move(reply));
      return;
    case CellState::kStopping:
      if (!at_laser_ && !activity_->next_start()) return reply(refusal(view_.state, CellCommand::kHold));
      break;
    case CellState::kStarting:
    case CellState::kUnsuspending:
      if (proof_.give_up()) jogging_.stop_for_others();
      refused({ErrorCode::kCancelled, "held before anything was burnt"});
      return reply(Ok());
    case CellState::kUnholding:
      answer(Error{ErrorCode::kCancelled, "held again"});
      break;
    default:
      break;
  }
  view_.hold_commanded = true;
  enter(CellState::kHolding);
  pending_.push_back(std::move(reply));
  if (proof_.give_up()) return parts().laser.stop_jog();  // whatever the camera sees now, Unhold looks anew
  if (at_laser_ && !laser_held_) return parts().laser.hold();
  enter(CellState::kHeld, at_laser_ ? "held by the operator" : "held between two pieces");
  answer(Ok());
}

// What is not burnt yet is given up, and what burns ends here, beam first.
void JobRunner::give_up_aside(const std::string& who, const Reply& reply) {
  const std::string doing = activity_->doing();
  if (at_laser_)
    abort_by(who, fmt::format("held while {}: Clear and Reset, then start the job again", doing));
  else
    refused({ErrorCode::kCancelled, fmt::format("held before {}", doing)});
  audit(who, "cell.hold");
  reply(Ok());
}

Error JobRunner::busy_aside() const {
  return {ErrorCode::kConflict, fmt::format("the cell is {} just now: wait until the head stands", activity_->doing())};
}

void JobRunner::unhold(Reply reply) {
  if (const Status wanted = activity_->still_wanted(); !wanted) {
    enter(CellState::kUnholding);
    enter(CellState::kHeld, wanted.error().message);
    return reply(wanted);
  }
  if (const Status ready = check_machine(parts().laser.status()); !ready)
    return reply(Error{ready.error().code, ready.error().message + "; then Unhold"});
  enter(CellState::kUnholding, activity_->needs_look() ? "looking whether all lies as it did" : "");
  pending_ = {std::move(reply)};
  prove([this](const Status& proven) {
    if (!proven) {
      enter(CellState::kHeld, proven.error().message);
      return answer(proven);
    }
    if (at_laser_) {
      laser_held_ = false;
      return parts().laser.resume();
    }
    enter(CellState::kExecute);
    answer(Ok());
    next();
  });
}

void JobRunner::stop(const std::string& who, const Reply& reply) {
  const CellState from = view_.state;
  if (from == CellState::kExecute && activity_->end_early(false, who)) {
    enter(CellState::kStopping, "finishing the piece that is being cut");
    reply(Ok());
    return next();
  }
  if (from == CellState::kHeld && !at_laser_ && activity_->end_early(true, who)) {
    enter(CellState::kStopping);
    reply(Ok());
    return next();
  }
  // What was begun cannot be finished without motion, and a run that is being prepared may be in the database already:
  // both end as an abort.
  if (activity_ || from == CellState::kResetting) {
    abort_by(who, "stopped by the operator");
    return reply(Ok());
  }
  enter(CellState::kStopping);
  answer(Error{ErrorCode::kCancelled, "stopped by the operator"});
  end_epoch();
  view_.job ? record_.end_job(view_.job->id, who) : record_.end(WorkRecord::Work::kJob);
  enter(CellState::kStopped);
  reply(Ok());
}

void JobRunner::stop_after_piece(const std::string& who, const Reply& reply) {
  const bool cutting = view_.state == CellState::kExecute || view_.state == CellState::kHolding ||
                       view_.state == CellState::kHeld || view_.state == CellState::kUnholding;
  if (!cutting || !activity_->end_early(false, who))
    return reply(Error{ErrorCode::kConflict, "no piece is being cut, so there is nothing to stop after"});
  audit(who, "cell.stop-after-piece");
  if (view_.state == CellState::kExecute) view_.reason = "stopping after this piece";
  on_change_();
  reply(Ok());
  next();
}

Error JobRunner::no_panel_yet() const {
  return {ErrorCode::kRefused, view_.load ? view_.load->sentence : "no panel was found yet"};
}

Status JobRunner::still_holds(const Consent& given) const {
  return check_consent(given, consent(), parts().laser.status());
}

void JobRunner::write_off_look(const std::string& who, const Reply& reply) {
  if (!owed_.any())
    return reply(Error{ErrorCode::kConflict, "the camera has seen all that was cut: there is no look to write off"});
  // A piece that is still to be booked would be booked as cut after this.
  if (const Status booked = check_booked(doings()); !booked) return reply(booked);
  audit(who, "cell.write-off-look", view_.owed_look->panel.value);
  owed_.write_off(who);
  reply(Ok());
}

void JobRunner::unsuspend(const std::string& who, Reply reply, const std::vector<std::string>& confirmed) {
  if (activity_) return reply(busy_aside());
  if (wait_.found() == nullptr) return reply(no_panel_yet());
  if (const Status given = require_confirmed(confirmed); !given) return reply(given);
  if (const Status may = may_book(); !may) return reply(may);
  owed_.judge(*wait_.found());  // none is owed beyond the next run
  auto run = std::make_unique<PanelRun>(host(), view_.job->id, who, *wait_.found(), wait_.setup_pieces(),
                                        !wait_.is_last_setup(), recuts_.cuts());
  from_ = CellState::kSuspended;
  enter(CellState::kUnsuspending, "proving the pose once more");
  undertake(std::move(run), {}, std::move(reply));
}

void JobRunner::recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who,
                      Reply reply) {
  if (!after(view_.state, CellCommand::kRecut) || check_reply_) return reply(refusal(view_.state, CellCommand::kRecut));
  if (is_aside()) return reply(busy_aside());
  auto burns = recuts_.find(marks);
  if (!burns) return reply(burns.error());
  if (const Status given = require_confirmed(confirmed); !given) return reply(given);
  if (const Status checked = check(*burns); !checked) return reply(checked);
  audit(who, "job.recut", fmt::format("{}; confirmed: {}", fmt::join(marks, ", "), fmt::join(confirmed, ", ")));
  from_ = view_.state;
  reason_from_ = view_.reason;
  view_.recutting = true;
  enter(CellState::kUnsuspending, "proving that the panel has not moved");
  undertake(std::make_unique<Recut>(host(), recuts_.cuts().pose(), recuts_.cuts().basis(), std::move(*burns)),
            "cutting again what was not through", std::move(reply));
}

void JobRunner::frame(PowerFraction power, const std::string& who, const Reply& reply,
                      const std::vector<std::string>& confirmed) {
  if (view_.state != CellState::kSuspended)
    return reply(Error{ErrorCode::kConflict,
                       "the frame is traced while the cell is Suspended and the panel is found: start a job and lay "
                       "its panel"});
  if (wait_.found() == nullptr) return reply(no_panel_yet());
  if (activity_) return reply(busy_aside());
  const bool burning = power > PowerFraction(0);
  if (const Status given = burning ? require_confirmed(confirmed) : Ok(); !given) return reply(given);
  auto frame = FrameTrace::of(host(), wait_.burns(), *wait_.found(), power, options_, reply);
  if (!frame) return reply(frame.error());
  audit(who, "cell.frame", fmt::format("{:.3f}; confirmed: {}", power.count(), fmt::join(confirmed, ", ")));
  from_ = view_.state;
  view_.reason =
      burning ? fmt::format("tracing the frame at {:.1f} % power", 100 * power.count()) : "tracing the frame, dark";
  undertake(std::move(*frame), {}, nullptr);
}

void JobRunner::burn_pattern(Pattern pattern, const std::string& who, Reply reply, std::vector<std::string> confirmed,
                             std::function<Status()> wanted) {
  if (view_.state != CellState::kIdle || check_reply_) return reply(refusal(view_.state, CellCommand::kStart));
  const bool burning = has_beam(pattern.strokes);
  if (const Status given = burning ? require_confirmed(confirmed) : Ok(); !given) return reply(given);
  PieceBurn all{{}, {}, std::move(pattern.strokes), 0};
  if (const Status checked = check({&all, 1}); !checked) return reply(checked);
  audit(who, "laser.pattern", fmt::format("{}", fmt::join(confirmed, ", ")));
  from_ = view_.state;
  view_.alone = true;
  enter(CellState::kStarting, burning ? "looking whether a panel of the stock lies on the bed" : "");
  const std::string doing =
      burning ? "burning the " + pattern.name : "running the " + pattern.name + " with the beam off";
  pattern.strokes = std::move(all.strokes);
  undertake(std::make_unique<PatternBurn>(host(), std::move(pattern), std::move(reply), confirmed, std::move(wanted)),
            doing, nullptr);
}

Status JobRunner::may_burn_pattern(const LaserJob& strokes, const std::vector<std::string>& confirmed) const {
  if (check_reply_) return refusal(view_.state, CellCommand::kStart);
  if (Status given = has_beam(strokes) ? require_confirmed(confirmed) : Ok(); !given) return given;
  const LaserStatus laser = parts().laser.status();
  Status able = view_.state == CellState::kIdle ? check_machine(laser) : check_before_homing(laser);
  if (!able) return able;
  if (strokes.strokes.empty() || limits_.travel.empty()) return Ok();
  // Unless the cell is Idle it is homed first, and from where that leaves the head nobody knows yet.
  const Point<MachineFrame> from =
      view_.state == CellState::kIdle ? laser.position : strokes.strokes.front().path.front();
  const PieceBurn all{{}, {}, strokes, 0};
  return check_strokes({&all, 1}, limits_, options_.keep_out, from);
}

void JobRunner::look_for_stock(std::vector<std::string> confirmed, Reply reply) {
  parts().bed.stock_in_sight([confirmed = std::move(confirmed), reply = std::move(reply),
                              alive = std::weak_ptr<int>(alive_)](const Result<StockSight>& seen) {
    if (!alive.expired()) reply(judge_stock(seen, confirmed));
  });
}

void JobRunner::check_pattern(LaserJob&& strokes, const std::string& who, Reply reply) {
  if (view_.state != CellState::kIdle || check_reply_) return reply(refusal(view_.state, CellCommand::kStart));
  audit(who, "laser.check");
  if (const Status taken = parts().laser.check(strokes); !taken) return reply(taken);
  check_reply_ = std::move(reply);
}

Doings JobRunner::doings() const {
  const LaserStatus laser = parts().laser.status();
  Doings now;
  now.state = view_.state;
  now.activity = activity_ != nullptr;
  now.jogging = jogging_.under_way();
  now.jog_coming = jogging_.coming();
  now.on_record = record_.any();
  now.reading = check_reply_ != nullptr;
  now.committing = committing();
  now.end_owed = owed_end_.any();
  now.beam_on = laser.beam_on;
  now.stands_still = stands_still(laser);
  return now;
}

}  // namespace veneer::daemon
