// What the wood of a piece is made of: the piece, the band of kerf around it, and what the lead-in burns beyond that
// band. Private to db. Pure functions; thread-safe.
#pragma once

#include "base/polygon_ops.h"

namespace veneer::db {

// Of `area`, the outline grown by the kerf and joined with what the lead-in burns, what lies farther from the outline
// than the kerf reaches. How wide that is, is measured: most of the area's border runs along the outline. Where
// lead-in and band meet, 3 um count as the band's, so that no rounding leaves slivers all around. Empty without an
// outline.
MicroArea lead_in_of(const MicroArea& area, const MicroRing& outline);
// What is neither piece nor lead-in; empty without an outline.
MicroArea kerf_of(const MicroArea& area, const MicroRing& outline, const MicroArea& lead_in);

}  // namespace veneer::db
