// The hull of what is about to be cut, traced over the panel while the unit waits for the operator's word. Dark, or
// with a power that marks: then the wood under the line is written off before.
#pragma once

#include <vector>

#include "daemon/unit/activity.h"

namespace veneer::daemon {

class FrameTrace final : public Activity {
 public:
  // `own` are the pieces the hull surrounds, cut in `pose`.
  FrameTrace(ActivityHost& host, LaserJob hull, const ProvenPose& pose, std::vector<PieceId> own, Reply reply);

  bool needs_look() const override { return burns_; }
  void look(Reply reply) override;
  void prepare(const Reply& ready) override;
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string& remark) override;
  std::optional<BrokenRun> broken_off(std::string& remark) override;
  void over(const Status& status) override { reply_(status); }

 private:
  ActivityHost& host_;
  LaserJob hull_;
  ProvenPose pose_;
  std::vector<PieceId> own_;
  Reply reply_;
  const bool burns_;
  bool begun_ = false;
};

}  // namespace veneer::daemon
