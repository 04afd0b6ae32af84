// One panel of a job being cut, from the proven pose to the last booked piece. Internal to the job runner.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "db/job_store.h"
#include "drivers/laser_job.h"

namespace veneer::daemon {

// One piece of a run, ready to burn.
struct PieceBurn {
  PieceId piece;
  std::string mark;
  LaserJob strokes;
  double seconds = 0;  // estimate
};

struct PanelRun {
  db::RunId id;
  PanelId panel;
  std::vector<PieceBurn> burns;
  std::size_t next = 0;           // index of the piece to burn next
  bool noted = false;             // the piece `next` is `cutting` in the database, but no stroke of it was sent yet
  bool burning = false;           // the laser has the piece next - 1
  bool hold_wanted = false;       // asked between two pieces: hold before the next one
  bool stop_after_piece = false;  // asked by the operator
  double seconds_left() const {
    double sum = 0;
    for (std::size_t i = next; i < burns.size(); ++i) sum += burns[i].seconds;
    return sum;
  }
};

}  // namespace veneer::daemon
