// The unit as others see it: status, console, routes. Values.
#pragma once

#include <optional>
#include <string>

#include "base/ids.h"
#include "base/units.h"
#include "daemon/unit/cell_state.h"
#include "daemon/unit/run_planner.h"
#include "db/job_store.h"

namespace veneer::daemon {

// Which panel is to be loaded, and what the camera sees.
struct LoadView {
  PanelId panel;
  std::string panel_name;
  RunSetup setup;
  bool found = false;  // panel, face and residual are proven and the job is checked whole: Unsuspend will be taken
  Millimetres rms{0};
  double seconds = 0;    // estimate of the run, device time; 0 until found
  std::string sentence;  // what to do, or what is wrong
};

struct JobView {
  JobId id;
  std::string name;
  int pieces = 0, cut = 0, suspect = 0;
  std::string current_piece;  // mark; "" when none is being cut
  double eta_seconds = 0;     // of the run that is on, device time
};

// What a job comes to: how many of its pieces are in each case.
struct JobRest {
  JobId id;
  std::string name;
  int pieces = 0;  // all that have or had wood
  int cut = 0, suspect = 0;
  int open = 0;     // to be cut
  int missing = 0;  // without wood
};
JobRest rest_of(const db::JobRecord& job);

// A run is over, and the camera has not seen since whether its panel lay under what was cut last (owed_proof.h).
struct OwedLook {
  JobId job;
  PanelId panel;
  int pieces = 0;
  std::string sentence;  // that, and what to do
};

struct CellView {
  CellState state = CellState::kStopped;
  std::string reason;           // why it is in this state, when that needs saying
  bool hold_commanded = false;  // Holding or Held because somebody said so, not by the machine or a doubt
  std::optional<JobView> job;
  std::optional<LoadView> load;
  bool framing = false;  // the frame is being traced: the head moves while Suspended
  bool alone = false;    // from Starting on: strokes of no job (PatternBurn), which ask for no panel
  int can_recut = 0;     // pieces that were cut in the pose the camera last proved
  PanelId recut_panel;   // on which
  JobId recut_job;       // of which job
  bool recutting = false;
  std::optional<OwedLook> owed_look;
  std::optional<JobRest> rest;  // of the job the unit had to do with last
};

}  // namespace veneer::daemon
