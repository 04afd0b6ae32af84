// The unit: one PackML state machine that owns the laser. It decides whether the machine may move; what it does then is
// an activity's business (activity.h): a panel's run, a recut, a pattern, a frame, one at a time.
//
// Consent: the machine moves only after an operator's Reset (homing), Unsuspend (cutting on a proven pose, once per
// panel loaded), Recut (on the same pose, proven unchanged), Unhold, frame, pattern or jog (jogging.h). Before each of
// these the whole of it is checked in machine space (preflight.h). Nothing here starts, resumes or reconnects by
// itself. Abort reaches the wire before this object does anything else.
//
// One door stands before every stroke: next(). It opens only while the state says that the operator's word holds, no
// write and no look is under way, the lid was not opened since the bed was proven, and the camera has looked within the
// last RunnerOptions::look_every pieces. Hold is a state, so that it is remembered whatever the laser, the database or
// the camera do meanwhile; Unhold proves the bed anew.
//
// Before a run ends the camera looks once more, so that every booked piece stands between two proofs. What is broken
// off owes that look (owed_proof.h).
//
// Who asks or commands sees no more of it than he needs: unit_state.h, cell_commands.h, job_commands.h,
// pattern_commands.h, jog_commands.h, override_commands.h. What goes on beside the states is told of them and has its
// own files: the wait for a panel, the proof of the bed, looks and ends that are owed, cuts that can be met again, the
// record of what is under way.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/store/audit_log.h"
#include "daemon/unit/activity.h"
#include "daemon/unit/at_rest.h"
#include "daemon/unit/bed_proof.h"
#include "daemon/unit/cell_commands.h"
#include "daemon/unit/cell_state.h"
#include "daemon/unit/cell_view.h"
#include "daemon/unit/consent.h"
#include "daemon/unit/job_commands.h"
#include "daemon/unit/job_progress.h"
#include "daemon/unit/jogging.h"
#include "daemon/unit/overrides.h"
#include "daemon/unit/owed_end.h"
#include "daemon/unit/owed_proof.h"
#include "daemon/unit/panel_wait.h"
#include "daemon/unit/pattern_commands.h"
#include "daemon/unit/recut_memory.h"
#include "daemon/unit/runner_options.h"
#include "daemon/unit/unit_state.h"
#include "daemon/unit/work_record.h"

namespace veneer::daemon {

class JobRunner : public UnitState,
                  public CellCommands,
                  public JobCommands,
                  public PatternCommands,
                  private ActivityHost {
 public:
  using Reply = std::function<void(Status)>;

  // `on_change` is called on the reactor after every change of view().
  JobRunner(boost::asio::io_context& reactor, const UnitParts& parts, RunnerOptions options, Logger log,
            std::function<void()> on_change);
  ~JobRunner() override;

  // After a crash: the state the recovery left behind. To be called once, before any command.
  void begin(const db::Recovery& recovery);

  // CellCommands
  void command(CellCommand command, const std::string& who, Reply reply, std::vector<std::string> confirmed) override;
  void stop_by(const std::function<std::string()>& who) override;
  TimePoint stop_given() const override { return stop_given_; }
  void stop_after_piece(const std::string& who, const Reply& reply) override;
  void write_off_look(const std::string& who, const Reply& reply) override;
  void frame(PowerFraction power, const std::string& who, const Reply& reply,
             const std::vector<std::string>& confirmed) override;

  // JobCommands
  void start_job(JobId job, const std::string& who, Reply reply) override;
  void recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who,
             Reply reply) override;

  // PatternCommands
  Status require_confirmed(const std::vector<std::string>& confirmed) const override;
  Status may_burn_pattern(const LaserJob& strokes, const std::vector<std::string>& confirmed) const override;
  void look_for_stock(std::vector<std::string> confirmed, Reply reply) override;
  void home(const std::string& who, Reply reply) override { command(CellCommand::kReset, who, std::move(reply), {}); }
  void burn_pattern(Pattern pattern, const std::string& who, Reply reply, std::vector<std::string> confirmed,
                    std::function<Status()> wanted) override;
  void check_pattern(LaserJob&& strokes, const std::string& who, Reply reply) override;

  JogCommands& jogging() { return jogging_; }
  OverrideCommands& overrides() { return overrides_; }

  // UnitState
  const CellView& view() const override { return view_; }
  bool is_connected() const override { return laser_connected_; }
  const LaserLimits& limits() const override { return limits_; }
  Consent consent() const override { return {parts().laser.status().lid_openings, states_entered_}; }
  Status still_holds(const Consent& given) const override;
  Status at_rest() const override { return check_at_rest(doings()); }

  // STOP. The reset byte is on the wire when this returns; the rest follows.
  void abort(const std::string& reason) noexcept override;
  // The process ends in order. As abort(), but that is no abort of a cell at_rest(): the next start finds it Stopped.
  void end(const std::string& reason);
  // `then` comes when the database has taken, or refused, what an abort before this call had to tell it.
  void when_written(std::function<void()> then);

  // May the machine move, at once or without another word: homing, or an activity that is not held.
  bool may_move() const {
    return view_.state == CellState::kResetting || (activity_ != nullptr && view_.state != CellState::kHeld);
  }
  // Neither moves anything nor burns, and none of it is about to: a STOP could wait.
  bool nothing_moves() const { return allows_owed_look(doings()); }
  // May people who only watch have pictures of the bed (at_rest.h)?
  Status may_be_watched() const { return check_may_be_watched(view_.state); }
  const RunnerOptions& options() const { return options_; }
  // Somebody else said something of the job's pieces: what the view tells of them is read again.
  void job_changed(JobId job);
  // Looks at the bed once more while Suspended, and at rest while a look is owed; called by a timer of the owner.
  void look_again();

 private:
  ActivityHost& host() { return *this; }
  bool looks_again() const override { return options_.look_every > 0; }
  void proven(db::RunId run) override;
  void ends_unproven(db::UnprovenCuts cuts) override;
  Doings doings() const;
  Error no_panel_yet() const;
  Status may_book() const;  // whether what a run cuts could be
  bool may_look_for_owed() const { return owed_.any() && allows_owed_look(doings()); }
  bool is_unproven_at_the_end() const;
  void doubted(JobId job, const std::string& why);
  bool is_aside() const { return activity_ && activity_->is_aside(); }
  void enter(CellState state, std::string reason = {});
  void audit(const std::string& who, const std::string& what, const std::string& detail = {});
  void answer(const Status& status);

  // job_runner.cc: commands
  void reset(Reply reply);
  void stop(const std::string& who, const Reply& reply);
  void clear(const std::string& who, Reply reply);
  void hold(Reply reply);
  void give_up_aside(const std::string& who, const Reply& reply);
  Error busy_aside() const;
  void unhold(Reply reply);
  void unsuspend(const std::string& who, Reply reply, const std::vector<std::string>& confirmed);
  void prepare_job(JobId job, const std::function<void(const Error&)>& give_up);
  void await_panel();

  // job_runner_activity.cc: an activity from its beginning to its end, and the door before every stroke
  void undertake(std::unique_ptr<Activity> activity, const std::string& doing, Reply begun);
  void prove_first(const std::string& doing);
  void begun(const std::string& doing);
  void next() override;
  void burn(const LaserJob& strokes) override;
  void prove(Reply then);
  void prove_again();
  void rest(const std::string& reason);
  void ending(Afterwards afterwards) override;
  WorkRecord::End work_ends() override { return record_.end_all_with(); }
  void ended(Afterwards afterwards, const std::string& reason) override;
  void refused(const Error& error) override;
  void go_back(const Activity& from, const std::string& reason);
  std::unique_ptr<Activity> retire();
  void bury(std::unique_ptr<Activity> activity);
  Status check(std::span<const PieceBurn> burns) const override;
  void show_piece(JobId job, const std::string& mark, double eta_seconds) override {
    progress_.show_piece(job, mark, eta_seconds);
  }
  void piece_booked(const PieceBurn& burn) override;
  void recount(std::function<void()> then) override;
  void bed_remark(const std::string& text) override;
  // `who` said so; "": nobody did.
  void break_off(const std::string& reason, const laser_event::Aborted* told, bool was_at_rest = false,
                 const std::string& who = {});
  void abort_by(const std::string& who, const std::string& reason);
  void owe_clear(const std::string& reason, const std::string& who);

  // job_runner_laser.cc: what the laser says
  void on_laser(const LaserEvent& event);
  void on_failed(const Error& error);
  void on_held();
  void on_resumed();
  void on_done(const std::string& remark);
  void on_jog_ended(const laser_event::JogEnded& jog);

  boost::asio::io_context& reactor_;
  const RunnerOptions options_;
  Logger log_;
  AuditLog audit_log_;
  std::function<void()> on_change_;

  CellView view_;
  std::int64_t states_entered_ = 0;
  TimePoint stop_given_;
  std::string bed_remark_;  // of the activity's looks at the bed; stands as the reason while it goes on
  bool laser_connected_ = false;
  LaserLimits limits_;
  PanelWait wait_;
  BedProof proof_;
  OwedProof owed_;
  OwedEnd owed_end_;
  JobProgress progress_;
  RecutMemory recuts_;
  WorkRecord record_;
  Jogging jogging_;
  Overrides overrides_;

  std::unique_ptr<Activity> activity_;
  CellState from_ = CellState::kStopped;  // where the unit was when the activity was asked for
  std::string reason_from_;
  bool at_laser_ = false;    // the laser has strokes of it and has not told their end
  bool laser_held_ = false;  // in the middle of them
  bool homing_ = false;      // it is on record that the laser is homed, and may be
  bool recording_ = false;   // the activity is not on record yet

  std::vector<Reply> pending_;                             // the command whose acting state is on
  Reply check_reply_;                                      // while the controller reads a pattern
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);  // what outlives this holds it weakly
};

}  // namespace veneer::daemon
