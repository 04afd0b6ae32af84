// The simulated flatbed: images what lies on its glass.
//
// Pure functions; use all cores.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "drivers/sim/scan_truth.h"
#include "drivers/sim/sheet.h"

namespace veneer::sim {

// What lies between sheet and glass at this capture; render_scan shows the same for the same seed.
std::vector<Dust> dust_of_scan(const ScanTruth& truth, std::uint64_t seed);

// BGR picture of the glass. `sheet` may be null: only the lid. Equal arguments give equal pictures.
cv::Mat render_scan(const ScanTruth& truth, const Sheet* sheet, std::uint64_t seed);

}  // namespace veneer::sim
