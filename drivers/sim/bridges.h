// The hand that takes pieces out which hang by bridges: where a cut was left out over a short way, whoever lifts the
// sheet cuts it through with a knife, flush with the cut on both sides.
//
// What a bridge is, is seen in the wood alone: a cut ends, another goes on behind it in the same direction, there is
// wood between the two, and without that wood something comes free. The twin knows nothing of pieces or plans.
#pragma once

#include "drivers/sim/sheet.h"

namespace veneer::sim {

// Cuts through every bridge of the sheet; those cuts are appended to `burns`, by_hand. Returns how many there were.
int cut_bridges(Sheet& sheet);

}  // namespace veneer::sim
