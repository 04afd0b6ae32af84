// The inventory: every allocation of wood and its state.
//
//   reserved -> cutting | released        cutting -> cut | suspect
//   suspect -> cut | scrap | released     cut -> scrap
//
// Live allocations (all but `released`) of one panel never overlap; touching is allowed. The database itself refuses
// them: a trigger asks an R*Tree for neighbours and the SQL function veneer_areas_overlap (base/polygon_ops.h, on whole
// micrometres) for the truth; a connection without the function cannot insert. The wood of an allocation never changes,
// and the state moves only as above.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"

namespace veneer::db {

using AllocationId = NumericId<struct AllocationIdTag>;

enum class AllocationState { kReserved, kCutting, kCut, kSuspect, kScrap, kReleased };
const char* to_string(AllocationState state);

// Wood asked for. `outline` is the piece without kerf, `area` the outline grown by k: what nobody else may use.
struct NewAllocation {
  PanelId panel;
  JobId job;
  PieceId piece;
  Ring<PanelFrame> outline;
  Region<PanelFrame> area;
};

struct AllocationRecord {
  AllocationId id;
  PanelId panel;
  JobId job;      // 0 for wood written off
  PieceId piece;  // 0 for wood written off
  AllocationState state = AllocationState::kReserved;
  Ring<PanelFrame> outline;
  Region<PanelFrame> area;
  std::string reason;      // of wood written off; else empty
  std::string changed_at;  // when it entered this state
};

class Ledger {
 public:
  explicit Ledger(Database& database) : database_(&database) {}

  // The whole plan or nothing; kConflict names the first piece whose wood is taken.
  Status reserve(std::span<const NewAllocation> plan, const std::string& at);
  // Wood found missing or spoilt outside any job (reconciliation, a burnt test pattern). Live as scrap.
  Status write_off(const PanelId& panel, const Region<PanelFrame>& area, const std::string& reason,
                   const std::string& at);

  // Live allocations, oldest first; free wood is the panel's mask minus the union of their areas.
  Result<std::vector<AllocationRecord>> live_allocations(const PanelId& panel);
  // Released ones too.
  Result<std::vector<AllocationRecord>> all_allocations(const PanelId& panel);

 private:
  Database* database_;
};

}  // namespace veneer::db
