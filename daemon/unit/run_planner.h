// How a job's panels are to be laid, and the strokes of their pieces. Slow: off the reactor, replies on it.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "daemon/unit/piece_burn.h"
#include "daemon/unit/proven_pose.h"
#include "db/job_store.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

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

// A run's strokes, and on what they stand (but for who gives the word).
struct PreparedRun {
  std::vector<PieceBurn> burns;
  db::RunFacts facts;
};

class RunPlanner {
 public:
  virtual ~RunPlanner() = default;
  // How the panels of these pieces are to be laid, in the order of cutting.
  virtual void plan_setups(std::vector<db::PieceRecord> pieces, Box<MachineFrame> travel,
                           std::function<void(Result<std::vector<RunSetup>>)> reply) = 0;
  // Toolpaths of these pieces for this pose, and how long this machine takes for each.
  virtual void prepare(const ProvenPose& pose, std::vector<db::PieceRecord> pieces,
                       const std::optional<LaserMotion>& machine, std::function<void(Result<PreparedRun>)> reply) = 0;
};

}  // namespace veneer::daemon
