// What a person is to do next at the cell, in one sentence: from the first certificate to the last piece. Pure.
//
// What the unit waits for comes first, then what keeps anything from being cut at all (database, certificates, wood),
// then the job that was begun, the one that waits, and a new picture at last.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/ids.h"
#include "base/units.h"
#include "daemon/store/calibration.h"
#include "daemon/unit/cell_view.h"
#include "db/job_store.h"
#include "db/plans.h"
#include "db/proposals.h"

namespace veneer::daemon {

enum class Step {
  kWait,  // something is going on: nothing is to be done
  kRepairDatabase,
  kCalibrateScanner,
  kCalibrateCamera,
  kCalibrateLaser,
  kCalibrateKerf,
  kAccept,  // or refuse what a scan saw
  kScan,    // a panel
  kPlan,    // a picture
  kMakeJob,
  kReset,
  kStart,
  kLoad,     // lay a panel on the bed
  kConfirm,  // say what was seen to, then Unsuspend
  kUnhold,
  kStop,  // what is Held and nobody wants any more
  kClear,
  kSettle,  // say what became of suspect pieces
  kRedo,    // find other wood for missing ones
};
std::string_view to_string(Step step);  // "calibrate_scanner", as the API has it

// What the unit's view does not tell. Certificates in the order in which they are made.
struct CellNeeds {
  struct Waiting {
    std::int64_t id = 0;
    std::string name;
    int pieces = 0;  // still to be cut, or planned
  };
  struct Certificate {
    db::CertificateKind kind;
    CertificateState state;
  };
  struct Suspects {
    JobId job;
    int pieces = 0;
  };
  bool is_counted = true;  // false: nothing of what the database tells is known yet
  bool database_damaged = false;
  std::string database_busy;   // a sentence while it is checked, or damaged; "" when it is good
  std::string backups_silent;  // a sentence while the disk of the backups does not answer; else ""
  bool choice_lost = false;    // devices were chosen once, and the file that says which is gone
  std::vector<Certificate> certificates;
  std::vector<Millimetres> camera_views;   // of the calibration that was begun: heights, in the order they were taken
  int panels = 0;                          // in stock
  std::optional<db::ProposalId> proposal;  // the oldest that waits to be accepted or refused
  std::vector<PanelId> to_scan;            // of those, nothing is planned from until they are scanned
  std::vector<std::string> confirm;        // asked for by name before the beam comes on
  std::optional<Waiting> job, plan;        // the first of the queue; the newest plan of which no job was made
  std::vector<Suspects> suspects;          // of each job that has any
  std::vector<db::JobLoss> missing;        // of each job that only other wood completes
  double device_seconds_per_second = 1;    // of a simulated cell's clock
};

struct NextStep {
  Step step = Step::kWait;
  std::string sentence;                  // for a person at the machine or its page: names buttons, no commands
  std::string command;                   // of veneerctl, which does the step or its first part; "" when none does
  std::optional<std::int64_t> job = {};  // that it leads to: of kStart, and of kReset before it
};

NextStep next_step(const CellView& view, const CellNeeds& needs);

}  // namespace veneer::daemon
