// The inventory: every allocation of wood and its state.
//
//   reserved -> cutting | released        cutting -> cut | suspect
//   suspect -> cut | scrap | released     cut -> scrap
//   scrap -> suspect                      of a piece that was called lost by mistake, and has no other wood
//   reserved, cut -> suspect              when a beam may have strayed onto them (JobStore::abort_run)
//   leased -> released                    when the lease ends (db/leases.h)
//
// Live allocations (all but `released`) of one panel never overlap; touching is allowed. The database itself refuses
// them: a trigger asks an R*Tree for neighbours and the SQL function veneer_areas_overlap (base/polygon_ops.h, on whole
// micrometres) for the truth; a connection without the function cannot insert. The wood of an allocation never changes,
// the state moves only as above, and no row is ever deleted.
//
// Wood is reserved by making a job of a plan (JobStore::create), and moved by running it; a plan may lease it before.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "db/database.h"
#include "db/plans.h"

namespace veneer::db {

using AllocationId = NumericId<struct AllocationIdTag>;

enum class AllocationState { kLeased, kReserved, kCutting, kCut, kSuspect, kScrap, kReleased };
const char* to_string(AllocationState state);

struct AllocationRecord {
  AllocationId id;
  PanelId panel;
  JobId job;      // 0 for wood leased or written off, or gone before its panel was sawn off another
  PieceId piece;  // the same
  AllocationState state = AllocationState::kReserved;
  Region<PanelFrame> area;   // what nobody else may use: of a piece's wood, outline, band of kerf and lead-in
  Ring<PanelFrame> outline;  // of the piece, without kerf; empty for wood leased or written off
  // What is burnt where the cut begins, beyond the band; that band is the rest of the area (kerf_of).
  Region<PanelFrame> lead_in;
  std::string reason;      // of wood without a piece; else empty
  std::string changed_at;  // when it entered this state
  PlanId leased_to;        // 0 for all other wood
};

// A state that wood entered, in one row with whose wood it is. Of wood booked before schema 11 the last step alone.
struct WoodStep {
  std::int64_t number = 0;  // steps are numbered in their order, over all panels
  AllocationId allocation;
  PanelId panel;
  JobId job;         // 0 for wood that is no piece's
  PieceId piece;     // the same
  std::string mark;  // the same: ""
  PlanId leased_to;  // 0 for all other wood
  AllocationState state = AllocationState::kReserved;
  SquareMillimetres area{0};  // all of it, kerf included
  std::string reason;         // of wood without a piece; else ""
  std::string at;
  std::optional<std::int64_t> run;  // that was on then, of its job on its panel
  std::string who;                  // gave the word for that run
};

// The band that is burnt around a piece; empty for wood that is no piece's.
Region<PanelFrame> kerf_of(const AllocationRecord& allocation);

class Ledger {
 public:
  explicit Ledger(Database& database) : database_(&database) {}

  // Wood found missing or spoilt outside any job (reconciliation, a burnt test pattern). Live as scrap.
  Status write_off(const PanelId& panel, const Region<PanelFrame>& area, const std::string& reason,
                   const std::string& at);
  // The same for what of `area` nothing is booked on, which may be nothing; how much that was.
  // Along a border with what is booked 3 um stay free, so that no rounding lets the two overlap.
  Result<SquareMillimetres> write_off_free(const PanelId& panel, const Region<PanelFrame>& area,
                                           const std::string& reason, const std::string& at);

  // Where wood was booked or moved after step `after` of the ledger's history, and the number of its newest step: what
  // somebody counted of other panels still holds. After a step below 0 the newest alone is told.
  struct Changes {
    std::int64_t newest = 0;
    std::string mark;  // of the newest
    std::vector<PanelId> panels;
  };
  Result<Changes> changes_after(std::int64_t after);
  // By which a step is known again where a history may be another one, as after a backup was put back; empty when
  // there is no such step.
  Result<std::string> mark_of_step(std::int64_t step);

  // Live allocations, oldest first; free wood is the panel's mask minus the union of their areas.
  Result<std::vector<AllocationRecord>> live_allocations(const PanelId& panel);
  // The live ones at a place: one, or two that touch there.
  Result<std::vector<AllocationRecord>> allocations_at(const PanelId& panel, const Point<PanelFrame>& place);
  // Whose wood it was before its panel was sawn off another, however often since; nothing of wood that was no piece's.
  Result<std::optional<PieceId>> piece_before(AllocationId carried);
  // What states live allocations are in, without their shapes: what a figure needs again and again.
  Result<std::vector<std::pair<AllocationId, AllocationState>>> live_states(const PanelId& panel);
  // How much wood it takes; never changes.
  Result<SquareMillimetres> area_of(AllocationId allocation);
  // All that ever happened to wood: at most `limit` steps behind the one of number `after`.
  Result<std::vector<WoodStep>> steps(std::int64_t after, int limit);
  // At most `limit` of all, released ones too, behind `after`.
  Result<std::vector<AllocationRecord>> allocations(const PanelId& panel, AllocationId after, int limit);

 private:
  Database* database_;
};

}  // namespace veneer::db
