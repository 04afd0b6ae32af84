// The hull of what is about to be cut, traced over the panel while the unit waits for the operator's word. Dark, or
// with a power that marks: then the wood under the line is written off before.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/unit/activity.h"

namespace veneer::daemon {

class FrameTrace final : public Activity {
 public:
  // Around what `burns` cut in `pose`. `over` is told how it ended. kInvalidArgument when `power` is none that
  // `options` allow, kRefused when the machine cannot trace it as it stands.
  static Result<std::unique_ptr<FrameTrace>> of(ActivityHost& host, std::span<const PieceBurn> burns,
                                                const ProvenPose& pose, PowerFraction power,
                                                const RunnerOptions& options, Reply over);

  bool is_aside() const override { return true; }
  std::string doing() const override { return "tracing the frame"; }
  std::string recorded() const override;
  bool needs_look() const override { return burns_; }
  void look(Reply reply) override;
  bool proves_pose() const override { return false; }
  bool ends_unproven() const override { return false; }
  void prepare(const Reply& ready) override;
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string& remark) override;
  std::optional<BrokenRun> broken_off(const std::string& who, std::string& remark) override;
  void over(const Status& status) override { over_(status); }

 private:
  FrameTrace(ActivityHost& host, LaserJob hull, const ProvenPose& pose, std::vector<PieceId> own, Reply over);

  ActivityHost& host_;
  LaserJob hull_;
  ProvenPose pose_;
  std::vector<PieceId> own_;  // the pieces that it surrounds
  Reply over_;
  const bool burns_;
  bool begun_ = false;
};

}  // namespace veneer::daemon
