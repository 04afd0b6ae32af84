// The strips of wood that a mask tells apart, as what enters stock with a panel. Pure; thread-safe.
#pragma once

#include <vector>

#include "calib/veneer_mask.h"
#include "db/materials.h"

namespace veneer::daemon {

// A zone is the wood of its strip as far as the mask calls it usable, and at most 0.2 mm and a pixel around it; more,
// twice as much as often as needed, where its outline would take more corners than `kMostZoneCorners`. Where that
// reaches another strip's zone, the one that is told more finely has the wood, of two alike the one with the lower
// number. Small holes (screws, knots) and cracks, no wider than 3 mm, are part of it: what is given back to the mask
// there is of that strip's wood. A hole as large as the smallest strip is none of it, for another strip may lie there.
// No two zones overlap. By number, with how sure the mask is of each, without materials.
std::vector<db::ZoneRecord> zones_of(const calib::VeneerMask& mask);
inline constexpr std::size_t kMostZoneCorners = 4'000;

}  // namespace veneer::daemon
