// One panel of a job being cut, from the proven pose to the last booked piece, and what is kept of it for a recut.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frames.h"
#include "base/ids.h"
#include "db/job_store.h"
#include "drivers/laser_job.h"

namespace veneer::daemon {

// What the camera proved about the sheet on the bed.
struct ProvenPose {
  PanelId panel;
  bool back_up = false;
  Isometry2<BedFrame, PanelFrame> bed_from_panel;
  Millimetres rms{0};
};

// How far the panel lies from where the other pose has it, at the worst of places far apart.
Millimetres moved_between(const ProvenPose& a, const ProvenPose& b);

// One piece of a run, ready to burn.
struct PieceBurn {
  PieceId piece;
  std::string mark;
  LaserJob strokes;
  double seconds = 0;  // estimate
};

// The cuts that were burnt and verified in one pose: while the panel lies as it did, they can be met again.
struct KeptCuts {
  ProvenPose pose;
  std::vector<PieceBurn> cuts;  // cut strokes only
};

// Pieces that were not through, cut again. Nothing of it is booked: they are cut already.
struct RecutRun {
  std::vector<PieceBurn> burns;
  std::size_t next = 0;
};

// How a run that was broken off is to be written down. Kept until that has succeeded: the disk may be full.
struct BrokenRun {
  db::RunId id;
  std::vector<PieceId> suspects;
  std::optional<PieceId> verified;  // burnt and proven, but its booking failed
  std::string reason;
};

struct PanelRun {
  db::RunId id;
  PanelId panel;
  std::vector<PieceBurn> burns;
  std::size_t next = 0;             // index of the piece to burn next
  bool noted = false;               // the piece `next` is `cutting` in the database, but no stroke of it was sent yet
  bool burning = false;             // the laser has the piece next - 1
  std::optional<PieceId> unbooked;  // burnt and proven, not booked yet
  bool hold_wanted = false;         // asked between two pieces: hold before the next one
  bool stop_after_piece = false;    // asked by the operator
  bool consented = false;           // the operator's word was given and nothing was burnt since
  double seconds_left() const {
    double sum = 0;
    for (std::size_t i = next; i < burns.size(); ++i) sum += burns[i].seconds;
    return sum;
  }
};

}  // namespace veneer::daemon
