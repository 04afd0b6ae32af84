// Strokes that belong to no job: a test pattern, a calibration pattern, a test card. They burn scrap: with a panel of
// the stock in the camera's sight they are refused, for nobody would book its wood.
#pragma once

#include "daemon/unit/activity.h"

namespace veneer::daemon {

class PatternBurn final : public Activity {
 public:
  PatternBurn(ActivityHost& host, LaserJob strokes, Reply reply);

  bool needs_look() const override { return burns_; }
  void look(Reply reply) override;
  std::optional<Point<MachineFrame>> next_start() const override;
  void go_on() override;
  void burnt(const std::string& remark) override;
  void over(const Status& status) override { reply_(status); }

 private:
  ActivityHost& host_;
  LaserJob strokes_;
  Reply reply_;
  const bool burns_;  // not all of it is dark
  bool begun_ = false;
};

// Is the beam on in any of them?
bool has_beam(const LaserJob& strokes);

}  // namespace veneer::daemon
