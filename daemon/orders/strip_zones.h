// The strips of wood that a mask tells apart, as what enters stock with a panel. Pure; thread-safe.
#pragma once

#include <vector>

#include "calib/veneer_mask.h"
#include "db/materials.h"

namespace veneer::daemon {

// A zone is the wood of its strip as far as the mask calls it usable, within 0.1 mm; coarser where that takes more
// corners than `kMostZoneCorners`. Small holes (screws, knots) and cracks, no wider than 3 mm, are part of it: what is
// given back to the mask there is of that strip's wood. A hole as large as the smallest strip is none of it, for
// another strip may lie there. No two zones overlap. By number, with
// how sure the mask is of each, without materials.
std::vector<db::ZoneRecord> zones_of(const calib::VeneerMask& mask);
inline constexpr std::size_t kMostZoneCorners = 4'000;

}  // namespace veneer::daemon
