// Does the cell know where a panel's wood lies: in its scans, and on the bed?
#pragma once

#include "drivers/sim/proof/truth.h"

namespace veneer::proof {

// Over a grid of 10 mm of true points that the captures show: where the claimed lattice puts the pixel that truly shows
// the point, against the point itself taken over by the fiducials' rigid motion. Nothing without a lattice that shows
// any of them.
std::optional<Residual> prove_registration(const Tie& tie, const Truth& truth);

// Claimed scans that tell nothing of the sheet: the twin has no such capture, or it shows another sheet.
std::size_t unattributed_scans(const Tie& tie, const Truth& truth);

// Over the same grid: claimed place on the bed against the true one. A run sees the sheet in some load no earlier than
// as many runs came before; poses are drawn afresh for each, so the best of those it may have seen is the one it saw.
// Nothing when the twin knows no such load.
std::optional<Residual> prove_pose(const ClaimedPose& pose, const Tie& tie, const Truth& truth);

}  // namespace veneer::proof
