// The waiting for a job's next panel: what the camera sees of it, the strokes for the pose it proved, and the check of
// the whole. Nothing moves. The operator's word comes to the JobRunner, which asks here what was found.
//
// Threading: bound to the reactor.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "daemon/unit/activity.h"
#include "daemon/unit/cell_view.h"

namespace veneer::daemon {

class PanelWait {
 public:
  using Check = std::function<Status(std::span<const PieceBurn>)>;
  // `check` is the preflight as the machine stands; `on_change` is called when view() has changed.
  PanelWait(BedView& bed, RunPlanner& planner, Check check, std::function<void()> on_change);

  // The job to come: its set-ups in the order of cutting, and its pieces that are still to be cut.
  void take_job(std::vector<RunSetup> setups, std::vector<db::PieceRecord> pieces);
  bool has_pieces() const { return !pieces_.empty(); }
  std::vector<db::PieceRecord> setup_pieces() const;  // of the set-up that is waited for
  bool is_last_setup() const { return setups_.size() <= 1; }
  void setup_done();
  void piece_done(PieceId piece) {
    std::erase_if(pieces_, [piece](const auto& p) { return p.id == piece; });
  }

  // From here to end() the bed is looked at, first now and then with each look_again().
  void begin(const std::optional<LaserMotion>& machine);
  void end();
  void look_again();
  // While the head moves over the panel the camera sees the head.
  void pause(bool paused) { paused_ = paused; }

  const std::optional<LoadView>& view() const { return view_; }
  // The panel is proven and the job was checked: its pose and strokes. nullptr before.
  const ProvenPose* found() const { return seen_ ? &*seen_ : nullptr; }
  const std::vector<PieceBurn>& burns() const { return drawn_->burns; }  // of what was found

 private:
  struct Drawn {
    ProvenPose pose;
    std::vector<PieceBurn> burns;
  };
  void saw(const Result<ProvenPose>& look);
  void take_strokes(const ProvenPose& pose, Result<PreparedRun> run);
  void judge(const ProvenPose& pose);
  bool waiting() const { return view_ && !paused_; }

  BedView& bed_;
  RunPlanner& planner_;
  Check check_;
  std::function<void()> on_change_;
  std::deque<RunSetup> setups_;  // still to come, the one waited for first
  std::vector<db::PieceRecord> pieces_;
  std::optional<LaserMotion> machine_;
  std::optional<LoadView> view_;  // while it waits
  bool looking_ = false, paused_ = false;
  std::optional<ProvenPose> seen_;
  std::optional<Drawn> drawn_;
  Epoch epoch_;
};

}  // namespace veneer::daemon
