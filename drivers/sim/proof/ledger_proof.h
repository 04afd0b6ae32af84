// Does the ledger say what was burnt? All that is truly burnt (through or engraved) or gone from a panel must lie
// within 0.25 mm of booked wood, and all wood booked as cut must be gone or burnt but for a rim of 0.25 mm inside each
// allocation's boundary.
#pragma once

#include <string>
#include <vector>

#include "drivers/sim/proof/cut_out.h"
#include "drivers/sim/proof/truth.h"

namespace veneer::proof {

struct LedgerProof {
  double unbooked_mm2 = 0;     // burnt or gone too far outside what is booked
  double still_there_mm2 = 0;  // booked as cut, still wood
  std::vector<std::string> notes;

  bool matches() const { return unbooked_mm2 == 0 && still_there_mm2 == 0; }
};

// `ledger` may hold rows of other panels; they are passed over.
LedgerProof prove_ledger(const Tie& tie, const BurnIndex& burns, const std::vector<CutOut>& cuts,
                         const std::vector<ClaimedAllocation>& ledger, int threads);

// Rows of wood that is out or in doubt whose piece reaches into another such row's piece: wood that two pieces claim.
// One sentence for each goes to `notes`.
std::size_t wood_used_twice(const std::vector<ClaimedAllocation>& ledger, std::vector<std::string>& notes);

// Whether the ledger says that wood was cut or written off at this point of a panel.
bool is_booked_at(Vec2 on_panel, const std::string& panel, const std::vector<ClaimedAllocation>& ledger);

}  // namespace veneer::proof
