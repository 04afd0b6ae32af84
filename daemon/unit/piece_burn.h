// One piece of a run, ready to burn.
#pragma once

#include <string>

#include "base/ids.h"
#include "drivers/laser_job.h"

namespace veneer::daemon {

struct PieceBurn {
  PieceId piece;
  std::string mark;
  LaserJob strokes;
  double seconds = 0;  // estimate
};

}  // namespace veneer::daemon
