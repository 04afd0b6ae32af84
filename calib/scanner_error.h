// How far off a scanner's map is expected to be, on all of the glass (calib/error_lattice.h). Private to calib.
//
// Two parts, as squares in one sum:
//  - what differs from scan to scan: how far a scan that the map was made without lies off where the others measured.
//    It is the same everywhere, and more corners make it no smaller.
//  - what the corners leave open: the posterior variance of the map (its least squares as a Gaussian process whose
//    prior is the smoothness), little where corners are and growing beyond them. How rough the scanner really is, the
//    prior does not know: the variance is scaled by how far off the map was at corners that were held out for it, a
//    strip along each side.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/error_lattice.h"
#include "calib/scanner_map_fit.h"

namespace veneer::calib {

// In nominal mm, x right and y down from the scan's upper left corner, over width x height. An error is what is left
// once the map is laid on the truth as well as can be where it was measured. `without` has, for each scan, the fit to
// all others: at least two. `refit` fits the map to those corners that are not dropped. Nothing where no strip could be
// held out, or where the fit leaves no number.
std::optional<ErrorLattice> predict_scanner_error(const std::vector<GridCorner>& corners, const ShiftLattice& lattice,
                                                  const MapFit& fit, std::span<const MapFit> without, double width,
                                                  double height,
                                                  const std::function<MapFit(const std::vector<GridCorner>&)>& refit);

}  // namespace veneer::calib
