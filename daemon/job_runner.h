// The unit: one PackML state machine that owns the laser and walks a job through its panels, piece by piece.
//
// The way of one piece: `cutting` is on the disk before its first stroke is sent; the laser burns engraving and cut,
// ends dark, drains and compares its own position with the expected one; only then the piece is booked `cut`. A kill at
// any moment therefore leaves at most one piece in doubt, and recovery calls that one suspect. One piece is one
// LaserJob, so nothing of the next piece can be burning while this one is in doubt.
//
// Consent: the machine moves only after an operator's Reset (homing), Unsuspend (cutting on a proven pose, once per
// panel loaded), Unhold, or pattern. Nothing here starts, resumes or reconnects by itself. Abort reaches the wire
// before this object does anything else.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <boost/asio/io_context.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/ids.h"
#include "base/log.h"
#include "base/result.h"
#include "daemon/cell_state.h"
#include "daemon/database_thread.h"
#include "daemon/panel_run.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// What the camera proved about the sheet on the bed.
struct ProvenPose {
  PanelId panel;
  bool back_up = false;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres rms{0};
};

// What lies between the runner and the slow world: the camera and the planner's toolpaths.
class RunSupport {
 public:
  virtual ~RunSupport() = default;
  // A fresh look at the bed, on the camera's worker; the reply comes on the reactor.
  virtual void look(std::function<void(Result<ProvenPose>)> reply) = 0;
  // Toolpaths of these pieces for this pose, off the reactor; the reply comes on the reactor.
  virtual void prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces,
                       std::function<void(Result<std::vector<PieceBurn>>)> reply) = 0;
};

// Which panel is to be loaded, and what the camera sees.
struct LoadView {
  PanelId panel;
  std::string panel_name;
  bool found = false;  // panel, face and residual are proven: Unsuspend will be taken
  Millimetres rms{0};
  std::string sentence;  // what to do, or what is wrong
};

struct JobView {
  JobId id;
  std::string name;
  int pieces = 0, cut = 0, suspect = 0;
  std::string current_piece;  // mark; "" when none is being cut
  double eta_seconds = 0;     // of the run that is on, device time
};

struct CellView {
  CellState state = CellState::kStopped;
  std::string reason;  // why it is in this state, when that needs saying
  std::optional<JobView> job;
  std::optional<LoadView> load;
};

class JobRunner {
 public:
  using Reply = std::function<void(Status)>;

  // `laser`, `database`, `support` outlive this. `on_change` is called on the reactor after every change of view().
  JobRunner(boost::asio::io_context& reactor, LaserDriver& laser, DatabaseThread& database, RunSupport& support,
            Logger log, std::function<void()> on_change);
  ~JobRunner();

  // After a crash: the state the recovery left behind. To be called once, before any command.
  void begin(const db::Recovery& recovery);

  // Refused with a sentence when the state does not allow it. The reply comes when the command is accepted and its
  // acting state has begun; Unsuspend's comes when the pose is proven again and the run begins.
  void command(CellCommand command, const std::string& who, Reply reply);
  void start_job(JobId job, const std::string& who, Reply reply);
  void stop_after_piece(const std::string& who, Reply reply);
  // Burns strokes that belong to no job (the calibration pattern); only when Idle. The reply comes when it is burnt.
  void burn_pattern(LaserJob strokes, const std::string& who, Reply reply);
  // STOP. The reset byte is on the wire when this returns; the rest follows.
  void abort(const std::string& reason) noexcept;

  const CellView& view() const { return view_; }
  // Of the laser, since it was connected last; empty travel before.
  const LaserLimits& limits() const { return limits_; }
  // Looks at the bed once more while Suspended; called by a timer of the owner, does nothing in other states.
  void look_again();

 private:
  void enter(CellState state, std::string reason = {});
  Status refuse(CellCommand command) const;
  void audit(const std::string& who, const std::string& what, const std::string& detail = {});

  void reset(Reply reply);
  void stop(Reply reply);
  void clear(Reply reply);
  void hold(Reply reply);
  void unhold(Reply reply);
  void unsuspend(Reply reply);

  void await_panel();
  void saw(Result<ProvenPose> look);
  void begin_run(const ProvenPose& pose);
  void run_prepared(const ProvenPose& pose, std::vector<PieceBurn> burns);
  void next_piece();
  void burn_noted_piece();
  void piece_verified();
  void end_run();
  void break_off(const std::string& reason, std::vector<PieceId> suspects);
  void stop_waiting_job();
  void answer(const Status& status);
  bool laser_busy() const;
  void refresh_job(std::function<void()> then);
  // Wraps a continuation so that it is dropped when the epoch has changed meanwhile.
  template <class F>
  auto while_current(F then) {
    return [epoch = epoch_, at = *epoch_, then = std::move(then)](auto&& result) mutable {
      if (*epoch == at) then(std::forward<decltype(result)>(result));
    };
  }

  void on_laser(const LaserEvent& event);
  void on_failed(const Error& error);
  void on_held();
  void on_resumed();
  void on_done();

  boost::asio::io_context& reactor_;
  LaserDriver& laser_;
  DatabaseThread& database_;
  RunSupport& support_;
  Logger log_;
  std::function<void()> on_change_;

  CellView view_;
  bool laser_connected_ = false;
  LaserLimits limits_;
  bool looking_ = false;
  std::optional<ProvenPose> seen_;       // the last look, when it proved the wanted panel
  std::vector<db::PieceRecord> to_cut_;  // the job's reserved pieces, panel by panel
  std::unique_ptr<PanelRun> run_;        // while a panel is being cut
  Reply pending_;                        // the command whose acting state is on
  Reply pattern_reply_;                  // while a pattern is burnt
  // Counts up whenever what was going on is over, so that replies meant for it find out. Copies of the pointer outlive
  // the runner; then it holds -1.
  std::shared_ptr<std::int64_t> epoch_;
};

}  // namespace veneer::daemon
