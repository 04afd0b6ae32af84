// The twin's truth as the proof needs it, and which true sheet a claimed panel is.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/sim/proof/claims.h"
#include "drivers/sim/proof/rigid.h"
#include "drivers/sim/scan_truth.h"
#include "drivers/sim/sheet.h"

namespace veneer::proof {

// Where a sheet lay from one laying on the bed to the next: several poses when it was nudged.
using BedLoad = std::vector<sim::SheetPose>;

struct Truth {
  std::map<std::string, std::shared_ptr<const sim::Sheet>> sheets;
  std::map<std::string, sim::ScanTruth> captures;     // by name
  std::map<std::string, std::vector<BedLoad>> loads;  // by sheet, in the order of time
};

// Reads the panels and captures that the claims speak of from the twin's state directory.
Result<Truth> load_truth(const std::filesystem::path& state_dir, const Claims& claims);

// A claimed panel tied to its sheet by the best rigid motion between claimed and true centres of fiducials.
struct Tie {
  const ClaimedPanel* panel = nullptr;
  const sim::Sheet* sheet = nullptr;
  Rigid panel_from_sheet;
  Residual fiducials;
};

// The sheet that carries most of the panel's tags; kNotFound when none does or no two fiducials can be paired.
Result<Tie> tie(const ClaimedPanel& panel, const Truth& truth);

}  // namespace veneer::proof
