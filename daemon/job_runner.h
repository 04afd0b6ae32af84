// The unit: one PackML state machine that owns the laser and walks a job through its panels, piece by piece.
//
// The way of one piece: `cutting` is on the disk before its first stroke is sent; the laser burns engraving and cut,
// ends dark, drains and compares its own position with the expected one; only then the piece is booked `cut`. A kill at
// any moment therefore leaves at most one piece in doubt, and recovery calls that one suspect. One piece is one
// LaserJob, so nothing of the next piece can be burning while this one is in doubt.
//
// Consent: the machine moves only after an operator's Reset (homing), Unsuspend (cutting on a proven pose, once per
// panel loaded), Recut (on the same pose, proven unchanged), Unhold, frame (dark, or at a low power) or pattern. Before
// each of these the whole of it is checked in machine space (preflight.h). Nothing here starts, resumes or reconnects
// by itself. Abort reaches the wire before this object does anything else.
//
// Threading: bound to the reactor. Replies come on the reactor, perhaps before the call returns.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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
#include "daemon/preflight.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

// What the cell's configuration says about the time before the beam comes on.
struct RunnerOptions {
  std::vector<std::string> confirm;     // what the operator confirms by name
  std::vector<KeepOut> keep_out;        // where the head must not go
  Millimetres thickness{0};             // of a panel: where the focus belongs
  MmPerSecond frame_speed{100};         // of the frame
  PowerFraction frame_max_power{0.03};  // that an operator may ask for
};

// One laying of one panel, and what is cut then.
struct RunSetup {
  PanelId panel;
  std::vector<PieceId> pieces;
  std::string how;         // "" = any way, back up; else how to lay it
  int number = 1, of = 1;  // of this panel's set-ups
  std::vector<std::array<double, 2>>
      outline;  // the panel's, in the camera's picture (fractions of its width and height)
};

// "lay panel P-0001 on the bed, back face up".
std::string how_to_lay(const RunSetup& setup);

// What lies between the runner and the slow world: the camera and the planner's toolpaths.
class RunSupport {
 public:
  virtual ~RunSupport() = default;
  // A fresh look at the bed, on the camera's worker; the reply comes on the reactor.
  virtual void look(std::function<void(Result<ProvenPose>)> reply) = 0;
  // How the panels of these pieces are to be laid, in the order of cutting; off the reactor, the reply on it.
  virtual void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame> travel,
                           std::function<void(Result<std::vector<RunSetup>>)> reply) = 0;
  // Toolpaths of these pieces for this pose, and how long this machine takes for each; off the reactor, the reply on
  // it.
  virtual void prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces,
                       const std::optional<LaserMotion>& machine,
                       std::function<void(Result<std::vector<PieceBurn>>)> reply) = 0;
};

// Which panel is to be loaded, and what the camera sees.
struct LoadView {
  PanelId panel;
  std::string panel_name;
  RunSetup setup;
  bool found = false;  // panel, face and residual are proven and the job is checked whole: Unsuspend will be taken
  Millimetres rms{0};
  double seconds = 0;    // estimate of the run, device time; 0 until found
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
  bool framing = false;  // the frame is being traced: the head moves while Suspended
  int can_recut = 0;     // pieces that were cut in the pose the camera last proved
  PanelId recut_panel;   // on which
};

class JobRunner {
 public:
  using Reply = std::function<void(Status)>;

  // `laser`, `database`, `support` outlive this. `on_change` is called on the reactor after every change of view().
  JobRunner(boost::asio::io_context& reactor, LaserDriver& laser, DatabaseThread& database, RunSupport& support,
            RunnerOptions options, Logger log, std::function<void()> on_change);
  ~JobRunner();

  // After a crash: the state the recovery left behind. To be called once, before any command.
  void begin(const db::Recovery& recovery);

  // Refused with a sentence when the state does not allow it. The reply comes when the command is accepted and its
  // acting state has begun; Unsuspend's comes when the pose is proven again and the run begins. `confirmed` is what the
  // operator confirms by name before the beam comes on (Unsuspend).
  void command(CellCommand command, const std::string& who, Reply reply, std::vector<std::string> confirmed = {});
  void start_job(JobId job, const std::string& who, Reply reply);
  void stop_after_piece(const std::string& who, const Reply& reply);
  // Burns strokes that belong to no job (a pattern); only when Idle. The reply comes when it is burnt. Strokes that are
  // all dark need no confirmation.
  void burn_pattern(LaserJob strokes, const std::string& who, Reply reply, std::vector<std::string> confirmed = {});
  // Traces the hull of what is about to be cut; only while Suspended with the panel found. Dark when `power` is 0. The
  // reply comes when it is traced. Nothing is proven by it: Unsuspend looks again.
  void frame(PowerFraction power, const std::string& who, Reply reply);
  // Cuts these pieces again (marks), their cut strokes only, after proving that the panel has not moved since they were
  // cut; engraving and the ledger stay as they are. The reply comes when the beam begins.
  void recut(std::vector<std::string> marks, std::vector<std::string> confirmed, const std::string& who, Reply reply);
  // Lets the controller read these strokes without moving; only when Idle. The reply comes when it has read them.
  void check_pattern(LaserJob strokes, const std::string& who, Reply reply);
  // Moves the head dark; only when Idle. The reply is at once, the way takes its time.
  Status jog(Millimetres dx, Millimetres dy, MmPerSecond speed, const std::string& who);
  // STOP. The reset byte is on the wire when this returns; the rest follows.
  void abort(const std::string& reason) noexcept;

  // kRefused, naming what is missing, unless everything of RunnerOptions::confirm is among them.
  Status require_confirmed(const std::vector<std::string>& confirmed) const;

  const CellView& view() const { return view_; }
  const RunnerOptions& options() const { return options_; }
  // Of the laser, since it was connected last; empty travel before.
  const LaserLimits& limits() const { return limits_; }
  // Looks at the bed once more while Suspended; called by a timer of the owner, does nothing in other states.
  void look_again();

 private:
  void enter(CellState state, std::string reason = {});
  Status refuse(CellCommand command) const;
  void audit(const std::string& who, const std::string& what, const std::string& detail = {});

  void reset(Reply reply);
  void stop(const Reply& reply);
  void clear(Reply reply);
  void hold(Reply reply);
  void unhold(Reply reply);
  void unsuspend(Reply reply, const std::vector<std::string>& confirmed);

  void await_panel();
  void saw(Result<ProvenPose> look);
  void take_strokes(const ProvenPose& pose, Result<std::vector<PieceBurn>> burns);
  void judge(const ProvenPose& pose);
  std::vector<db::PieceRecord> setup_pieces() const;
  Status check(std::span<const PieceBurn> burns) const;
  void next_recut();
  void end_recut(const std::string& reason);
  void keep_cuts(const PieceBurn& burn);
  void forget_cuts();
  void begin_run(const ProvenPose& pose);
  void run_prepared(const ProvenPose& pose, std::vector<PieceBurn> burns);
  void next_piece();
  void burn_noted_piece();
  void piece_verified();
  void end_run();
  void break_off(const std::string& reason, std::vector<PieceId> suspects);
  void write_end(BrokenRun run, std::function<void(Status)> then);
  void stop_waiting_job();
  void answer(const Status& status);
  bool laser_busy() const;
  bool lid_was_opened() const;
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
  const RunnerOptions options_;
  Logger log_;
  std::function<void()> on_change_;

  CellView view_;
  bool laser_connected_ = false;
  LaserLimits limits_;
  bool looking_ = false;
  std::optional<ProvenPose> seen_;  // the last look, when it proved the wanted panel and the job was checked
  struct Drawn {
    ProvenPose pose;
    std::vector<PieceBurn> burns;
  };
  std::optional<Drawn> drawn_;           // the strokes for the pose that was seen, while Suspended
  std::deque<RunSetup> setups_;          // still to come, the one waited for first
  std::vector<db::PieceRecord> to_cut_;  // the job's reserved pieces, panel by panel
  std::unique_ptr<PanelRun> run_;        // while a panel is being cut
  std::optional<BrokenRun> unwritten_;   // broken off, and the database could not take it; Clear tries again
  Reply pending_;                        // the command whose acting state is on
  Reply pattern_reply_;                  // while a pattern is burnt
  Reply frame_reply_;                    // while the frame is traced
  std::optional<KeptCuts> kept_;         // what can be cut again
  std::optional<RecutRun> recut_;        // while that is done
  CellState after_recut_ = CellState::kStopped;
  std::string reason_after_recut_;
  // Counts up whenever what was going on is over, so that replies meant for it find out. Copies of the pointer outlive
  // the runner; then it holds -1.
  std::shared_ptr<std::int64_t> epoch_;
};

}  // namespace veneer::daemon
