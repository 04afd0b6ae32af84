// What a scan of a panel and the ledger disagreed about. Each stays open until a person decides, or until a later scan
// does not see it any more.
//
// Bound to the thread of the Database it is given, which must outlive it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/ids.h"
#include "base/polygon_ops.h"
#include "base/result.h"
#include "base/units.h"
#include "db/database.h"

namespace veneer::db {

using DifferenceId = NumericId<struct DifferenceIdTag>;

enum class DifferenceVerdict {
  kWrittenOff,    // the wood is gone for good: what of it nothing was booked on is booked as scrap
  kAccepted,      // somebody looked, and nothing has to be done
  kNotSeenAgain,  // a later scan agreed with the ledger there
  kGrown,         // a later scan saw more of it, and entered that anew
};
const char* to_string(DifferenceVerdict verdict);

struct DifferenceRecord {
  struct Decision {
    DifferenceVerdict verdict = DifferenceVerdict::kAccepted;
    std::string who, note, at;  // who: "" for a scan
  };
  DifferenceId id;                 // 0 on insertion
  bool gone = false;               // wood is gone that is not booked; else booked as cut, and still in the panel
  Point<PanelFrame> place{};       // a point of it
  Region<PanelFrame> shape;        // what was seen of it; never empty
  SquareMillimetres area{0};       // stored in whole square micrometres
  std::string pieces_json = "[]";  // whose wood it may be, written and read by the daemon
  std::string found_at;
  std::optional<Decision> decision;  // the newest; nothing while it is open
};

class Differences {
 public:
  explicit Differences(Database& database) : database_(&database) {}

  // All that one scan found, what earlier ones had found too. One that is open or was accepted, and is seen at the same
  // place and no larger, is the same and stays as it is: each is the same as one at most. Those that are larger
  // now, or were not found again, are decided so, also accepted ones. A scan that was compared with a `later_map` than
  // the panel's first does not see what was gone before that map: then no wood that is gone counts as not found again.
  Status found(const PanelId& panel, const std::vector<DifferenceRecord>& differences, const std::string& at,
               bool later_map = false);
  // A person decides. Pieces whose reserved wood is written off are suspect from then on: they are returned. kNotFound;
  // kConflict when it was decided before, or when a run is on; kInvalidArgument when wood that is booked as cut
  // and still in the panel is to be written off: its pieces are scrap then (job redo), not wood without a job.
  Result<std::vector<PieceId>> decide(const PanelId& panel, DifferenceId difference, DifferenceVerdict verdict,
                                      const std::string& who, const std::string& note, const std::string& at);

  Result<std::vector<DifferenceRecord>> of(const PanelId& panel);  // the newest first, decided ones too
  // At most `limit` of them, of those older than `before`; {0}: of all.
  Result<std::vector<DifferenceRecord>> of(const PanelId& panel, DifferenceId before, int limit);
  // Those that were open once the scan of `version` of the panel's mask had been looked at, as far as no person has
  // decided since: what is open when later scans are taken back (Panels::revert_mask).
  Result<std::vector<DifferenceRecord>> open_after(const PanelId& panel, int version);

 private:
  Database* database_;
};

}  // namespace veneer::db
