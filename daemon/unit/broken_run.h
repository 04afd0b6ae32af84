// What was broken off over a panel, and how that is written down.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/result.h"
#include "daemon/store/database_thread.h"
#include "daemon/unit/proven_pose.h"
#include "db/job_store.h"
#include "drivers/laser_driver.h"

namespace veneer::daemon {

struct BrokenRun {
  void take(const laser_event::Aborted& told);  // what the laser tells of it

  std::optional<db::RunId> id;        // nothing: a recut, or a frame with power
  std::optional<JobId> waiting_job;   // without a run: it waited for its next panel, and is aborted with this
  ProvenPose pose;                    // of the panel under the head
  std::vector<PieceId> suspects;      // begun and not verified, as the laser tells
  std::optional<PieceId> verified;    // burnt and proven, but perhaps not booked
  std::vector<PieceId> unproven;      // booked, and nobody knows whether the panel lay under them
  Polyline<MachineFrame> stray_path;  // where the beam may have been off its path, and how far from this line
  Millimetres stray_reach{0};
  std::string reason;
  std::string who = {};  // broke it off, a person; "": nobody did
};

// In the database's thread, one piece of work: books what was proven, ends the run, and makes suspect what was begun,
// what is unproven and every neighbour, reserved or cut, within reach of the stray path; without a run all within reach
// are neighbours. Free and leased wood within reach is written off, and the leases end.
// Gives how many neighbours. Doing it twice changes nothing.
Result<int> write_down(Repositories& repositories, const BrokenRun& run, const std::string& at);

// Is this the last word on it? Not while the disk is full or the database busy: then it has to be tried again.
bool is_written(const Result<int>& written);

}  // namespace veneer::daemon
