// Pieces that were not through, cut again while the panel lies as it did. Nothing of it is booked: they are cut
// already.
#pragma once

#include <string>
#include <vector>

#include "daemon/unit/activity.h"
#include "daemon/unit/kept_cuts.h"

namespace veneer::daemon {

class Recut final : public Activity {
 public:
  // `burns`, not empty, were cut in `pose`, on `basis`.
  Recut(ActivityHost& host, const ProvenPose& pose, KeptCuts::Basis basis, std::vector<PieceBurn> burns);

  std::string recorded() const override;
  bool needs_look() const override { return true; }
  void look(Reply reply) override;
  bool proves_pose() const override { return true; }
  bool ends_unproven() const override { return false; }  // nothing of it is booked
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string&) override { host_.next(); }
  bool not_begun() override;
  std::optional<BrokenRun> broken_off(const std::string& who, std::string& remark) override;

 private:
  void look_at_bed(const Reply& reply);

  ActivityHost& host_;
  ProvenPose pose_;
  KeptCuts::Basis basis_;
  std::vector<PieceBurn> burns_;
  std::size_t next_ = 0;
};

}  // namespace veneer::daemon
