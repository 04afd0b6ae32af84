// A later scan of a panel's show face, as it enters stock: all that it brings in one transaction, or nothing of it. A
// mask without what the same scan found gone would let the saw of the next run into a hole, and a proposal that
// was accepted without its scans would have them deleted.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "db/database.h"
#include "db/differences.h"
#include "db/job_store.h"
#include "db/materials.h"
#include "db/panels.h"
#include "db/proposals.h"

namespace veneer::db {

struct LaterScan {
  MaskRecord mask;
  int after = 0;                                             // the version of the mask that it was compared with
  std::vector<ZoneRecord> zones;                             // of a panel that has none yet
  std::optional<std::vector<DifferenceRecord>> differences;  // nothing: it was not compared with the ledger
  bool later_map = false;                                    // as Differences::found
  // What was seen of suspect wood; the version of the mask is the new one's, whatever they say.
  std::vector<std::pair<AllocationId, Sighting>> sightings;
  std::vector<ScanRecord> scans;
  std::vector<FiducialRecord> new_tags;  // glued on since
};

class LaterScans {
 public:
  explicit LaterScans(Database& database) : database_(&database) {}

  // The number of the mask's new version. As Panels::add_mask, Panels::add_scans, Differences::found and
  // JobStore::note_sightings refuse; `of`: the proposal that is accepted with it.
  Result<int> enter(const PanelId& panel, const LaterScan& scan, const std::optional<Acceptance>& of = {});

 private:
  Database* database_;
};

}  // namespace veneer::db
