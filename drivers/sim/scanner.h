// The simulated flatbed: images what lies on its glass.
//
// Pure functions; use all cores.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "drivers/sim/scan_truth.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// BGR picture of the glass. `sheet` may be null: only the lid. Equal arguments give equal pictures.
cv::Mat render_scan(const ScanTruth& truth, const Sheet* sheet, std::uint64_t seed);

}  // namespace veneer::sim
