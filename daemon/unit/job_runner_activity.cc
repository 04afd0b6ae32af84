// An activity from the operator's word to its end, and the door before every stroke.
#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "base/clock.h"
#include "base/journal.h"
#include "daemon/unit/job_runner.h"
#include "daemon/unit/preflight.h"

namespace veneer::daemon {

void JobRunner::undertake(std::unique_ptr<Activity> activity, const std::string& doing, Reply begun) {
  activity_ = std::move(activity);
  owed_.disturb();
  bed_remark_.clear();
  if (is_aside()) {
    view_.framing = true;
    wait_.pause(true);
    on_change_();
  }
  if (begun) pending_ = {std::move(begun)};
  const std::string recorded = activity_->recorded();
  if (recorded.empty()) return prove_first(doing);
  recording_ = true;
  record_.begin(WorkRecord::Work::kActivity, recorded,
                while_current([this, doing, given = consent().lid_openings](const Status& written) {
                  recording_ = false;
                  const Status may = written ? check_lid_stayed(given, parts().laser.status()) : written;
                  may ? prove_first(doing) : refused(may.error());
                }));
}

void JobRunner::prove_first(const std::string& doing) {
  prove([this, doing](const Status& proven) {
    if (!proven) return refused(proven.error());
    // The bed was proven, and the strokes are made for what was seen: a lid that opens from here on undoes that.
    activity_->prepare(while_current([this, doing](const Status& ready) {
      if (!ready) return refused(ready.error());
      this->begun(doing);
    }));
  });
}

void JobRunner::begun(const std::string& doing) {
  if (!is_aside()) enter(CellState::kExecute, doing.empty() ? bed_remark_ : doing);
  answer(Ok());
  next();
}

// ---- The door ----------------------------------------------------------------------------------------------------

void JobRunner::next() {
  if (!activity_ || recording_ || at_laser_ || proof_.under_way() || committing()) return;
  const bool word_holds = view_.state == CellState::kExecute || view_.state == CellState::kStopping || is_aside();
  if (!word_holds) return;
  if (activity_->next_start()) {
    if (proof_.lid_was_opened()) return rest("the lid was opened since the bed was looked at: close it, then Unhold");
    if (proof_.is_due(*activity_)) return prove_again();
  } else if (is_unproven_at_the_end()) {
    if (proof_.lid_was_opened())
      return rest("the lid was opened before the camera had seen what was cut last: close it, then Unhold");
    return prove_again();
  }
  activity_->go_on();
}

bool JobRunner::is_unproven_at_the_end() const {
  return looks_again() && !activity_->next_start() && activity_->ends_unproven();
}

void JobRunner::burn(const LaserJob& strokes) {
  at_laser_ = true;
  laser_held_ = false;
  parts().laser.start(strokes);
}

// Nothing more is begun until the operator says so.
void JobRunner::rest(const std::string& reason) {
  if (is_aside()) return refused({ErrorCode::kRefused, reason});
  enter(CellState::kHolding);
  enter(CellState::kHeld, reason);
}

// It may be given up while the camera looks, and where none looks before it is on record.
void JobRunner::prove(Reply then) {
  proof_.begin(*activity_, !at_laser_, [this, then = std::move(then)](const Status& proven) {
    const Status wanted = activity_->still_wanted();
    then(wanted ? proven : wanted);
  });
}

// Every now and then while a run goes on, and before its end: a panel creeps, is bumped into, or is lifted.
void JobRunner::prove_again() {
  view_.reason = "looking whether the panel lies as it did";
  on_change_();
  prove([this](const Status& proven) {
    // Hands that came while the camera looked undo nothing of what it saw, and nothing is left to burn.
    const bool has_seen = !activity_->next_start() && !is_unproven_at_the_end() && proof_.lid_was_opened();
    if (!proven && !has_seen) return rest(proven.error().message);
    view_.reason = bed_remark_;
    on_change_();
    next();
  });
}

Status JobRunner::check(std::span<const PieceBurn> burns) const {
  const LaserStatus laser = parts().laser.status();
  if (Status ready = check_machine(laser); !ready) return ready;
  return check_strokes(burns, limits_, options_.keep_out, laser.position);
}

void JobRunner::piece_booked(const PieceBurn& burn) {
  wait_.piece_done(burn.piece);
  recuts_.show();
  ++view_.job->cut;
  const LogAbout about({.job = std::to_string(view_.job->id.value), .piece = burn.mark});
  log_->info("piece {} of job {} is cut", burn.mark, view_.job->id.value);
  view_.job->current_piece.clear();
  on_change_();
}

void JobRunner::recount(std::function<void()> then) {
  recuts_.count();
  progress_.refresh([this, then = std::move(then)] {
    on_change_();
    then();
  });
}

void JobRunner::bed_remark(const std::string& text) {
  if (text.empty())
    log_->info("the tags on the bed lie as they were scanned");
  else
    log_->warn("{}", text);
  bed_remark_ = text;
}

void JobRunner::proven(db::RunId run) {
  if (!looks_again()) return;
  parts().database.async([run](Repositories& r) { return r.jobs.note_proof(run, utc_timestamp()); },
                         [log = log_](const Status& noted) {
                           if (!noted) log->warn("{}", noted.error().message);  // more is owed after a kill
                         });
}

void JobRunner::ends_unproven(db::UnprovenCuts cuts) {
  if (looks_again()) owed_.owe(std::move(cuts));
}

void JobRunner::doubted(JobId job, const std::string& why) {
  log_->warn("{}", why);
  // Where nothing else is going on it is the reason to look here; of a run that is on, the alarm tells.
  const bool is_told = view_.state == CellState::kAborted || view_.state == CellState::kStopped ||
                       view_.state == CellState::kComplete || view_.state == CellState::kIdle ||
                       view_.state == CellState::kSuspended;
  if (is_told) view_.reason += view_.reason.empty() ? why : "; " + why;
  recuts_.forget();  // what lies elsewhere is not met again
  job_changed(job);
  on_change_();
}

// ---- The end -----------------------------------------------------------------------------------------------------

void JobRunner::ending(Afterwards afterwards) {
  switch (afterwards) {
    case Afterwards::kBack:
      return;
    case Afterwards::kStopped:
      if (view_.state != CellState::kStopping) enter(CellState::kStopping);
      return;
    case Afterwards::kNextPanel:
      wait_.setup_done();
      return enter(CellState::kSuspending);
    case Afterwards::kComplete:
      wait_.setup_done();
      return enter(CellState::kCompleting);
  }
}

void JobRunner::ended(Afterwards afterwards, const std::string& reason) {
  auto activity = retire();
  record_.end(WorkRecord::Work::kActivity);
  // A run's end is written with this already (work_ends). Else it is on its way to the disk before the cell is said to
  // rest.
  if (afterwards == Afterwards::kStopped || afterwards == Afterwards::kComplete) record_.end_all();
  switch (afterwards) {
    case Afterwards::kBack:
      go_back(*activity, reason);
      break;
    case Afterwards::kStopped:
      progress_.refresh([this, reason] { enter(CellState::kStopped, reason); });
      break;
    case Afterwards::kNextPanel:
      progress_.refresh([this] { await_panel(); });
      break;
    case Afterwards::kComplete:
      progress_.refresh([this, reason] { enter(CellState::kComplete, reason); });
      break;
  }
  activity->over(Ok());
  bury(std::move(activity));
}

void JobRunner::refused(const Error& error) {
  auto activity = retire();
  record_.end(WorkRecord::Work::kActivity);
  go_back(*activity, error.message);
  answer(error);
  activity->over(error);
  bury(std::move(activity));
}

void JobRunner::go_back(const Activity& from, const std::string& reason) {
  switch (from_) {
    case CellState::kSuspended:
      if (from.is_aside()) {
        wait_.pause(false);
        view_.reason = reason;
        return on_change_();
      }
      enter(CellState::kSuspending);
      return await_panel();
    case CellState::kComplete:
      enter(CellState::kCompleting);
      return enter(CellState::kComplete, reason_from_);
    case CellState::kStopped:
      enter(CellState::kStopping);
      return enter(CellState::kStopped, reason_from_);
    default:
      return enter(CellState::kIdle, reason);
  }
}

// From here on nothing that was meant for it arrives.
std::unique_ptr<Activity> JobRunner::retire() {
  end_epoch();
  view_.recutting = view_.framing = view_.alone = false;
  at_laser_ = laser_held_ = recording_ = false;
  proof_.give_up();
  return std::move(activity_);
}

// It may be its own call that ended it.
void JobRunner::bury(std::unique_ptr<Activity> activity) {
  boost::asio::post(reactor_, [dead = std::shared_ptr<Activity>(std::move(activity))] {});
}

void JobRunner::abort(const std::string& reason) noexcept {
  parts().laser.abort();
  break_off(reason, nullptr);
}

void JobRunner::abort_by(const std::string& who, const std::string& reason) {
  parts().laser.abort();
  break_off(reason, nullptr, false, who);
}

// Whether the cell rests is asked before the byte, which changes what the laser tells; nobody waits for an answer.
void JobRunner::end(const std::string& reason) {
  const bool was_at_rest = at_rest().ok();
  parts().laser.abort();
  break_off(reason, nullptr, was_at_rest);
}

void JobRunner::when_written(std::function<void()> then) {
  // The abort itself waits a turn of the reactor for what the laser tells of it (break_off).
  boost::asio::post(reactor_, [this, then = std::move(then)]() mutable {
    parts().database.async([](Repositories&) { return 0; }, [then = std::move(then)](int) { then(); });
  });
}

// Before anything else of the abort is written: where that is lost to a kill, what was running tells of it (recover).
void JobRunner::owe_clear(const std::string& reason, const std::string& who) {
  parts().database.owe([reason, who](Repositories& r) { return r.jobs.note_abort(reason, utc_timestamp(), who); });
  record_.forget();
}

// Everything that was going on ends here, with the beam already off.
void JobRunner::break_off(const std::string& reason, const laser_event::Aborted* told, bool was_at_rest,
                          const std::string& who) {
  jogging_.forget();
  if (!after(view_.state, CellCommand::kAbort)) return;
  const bool laser_will_tell = at_laser_ && told == nullptr;
  auto activity = retire();
  std::string remark;
  std::optional<BrokenRun> broken;
  if (activity) broken = activity->broken_off(who, remark);
  const std::string why_aborted = reason + remark;
  enter(CellState::kAborting, why_aborted);
  if (!was_at_rest) owe_clear(why_aborted, who);
  const Error why{ErrorCode::kCancelled, why_aborted};
  answer(why);
  if (check_reply_) std::exchange(check_reply_, nullptr)(why);
  const auto finish = [this, reason = why_aborted](int neighbours) {
    progress_.refresh([this, reason, neighbours] {
      std::string words = reason;
      if (neighbours > 0)
        words += fmt::format("; {} piece(s) beside it may have been hit and are suspect as well", neighbours);
      if (owed_end_.unwritten()) words += "; the end of the run is not written yet: make room on the disk, then Clear";
      enter(CellState::kAborted, words);
    });
  };
  if (broken) {
    broken->reason = reason, broken->who = who;
    if (!broken->id && view_.job && wait_.has_pieces()) broken->waiting_job = view_.job->id;
    if (told != nullptr) broken->take(*told);
    owed_end_.begin(*std::move(broken));
    // What a laser tells of its abort is in the reactor's queue already (drivers/laser_driver.h), before this.
    if (laser_will_tell)
      boost::asio::post(reactor_, [this, finish, moment = moment()] {
        if (moment.is_current()) owed_end_.write(finish);
      });
    else
      owed_end_.write(finish);
  } else if (view_.job && wait_.has_pieces()) {
    const auto write = [job = view_.job->id, who](Repositories& r) {
      return r.jobs.abort_job(job, utc_timestamp(), who);
    };
    parts().database.owe(write, [finish, moment = moment()] {
      if (moment.is_current()) finish(0);  // a planned job stays planned
    });
  } else {
    finish(0);
  }
  if (!activity) return;
  activity->over(why);
  bury(std::move(activity));
}

void JobRunner::job_changed(JobId job) {
  if (view_.job && view_.job->id == job && activity_ == nullptr) return progress_.refresh([this] { on_change_(); });
  if (view_.rest && view_.rest->id == job) progress_.refresh_rest(job);
}

}  // namespace veneer::daemon
