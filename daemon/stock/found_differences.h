// What wood and ledger disagree about, and whose wood that is.
#pragma once

#include <string>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "calib/reconcile.h"
#include "daemon/store/database_thread.h"
#include "db/differences.h"

namespace veneer::daemon {

// One of them, and the pieces whose wood it is: cut ones that still hang there, reserved ones whose wood is gone.
struct FoundDifference {
  struct Piece {
    JobId job;
    std::string mark;
    db::AllocationState state = db::AllocationState::kReserved;
  };
  calib::Difference seen;
  std::vector<Piece> pieces;
};

const char* in_words(calib::DifferenceKind kind);

// Whose wood each difference is; nobody's when it is free. On the database's thread.
Result<std::vector<FoundDifference>> with_pieces(Repositories& r, const PanelId& panel,
                                                 const std::vector<calib::Difference>& differences);

// As the ledger keeps them. Pure.
std::vector<db::DifferenceRecord> to_records(const std::vector<FoundDifference>& differences);

}  // namespace veneer::daemon
