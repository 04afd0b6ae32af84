// Finds the calibration pattern's cut lines on a scan. Private to calib.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/geometry.h"
#include "calib/kerf_meter.h"

namespace veneer::calib {

// Where one of the lines lies on the scan, in true mm of the picture: +x right, +y up, origin at the upper left corner.
struct SlitFrame {
  using Length = Millimetres;
};

struct FoundLine {
  std::size_t line = 0;  // index into the lines given
  Point<SlitFrame> from, to;
};

// Lines that were recognised, in the order given; empty when the constellation is not there.
std::vector<FoundLine> find_kerf_lines(const cv::Mat& scan, ScanResolution resolution, std::span<const KerfLine> lines,
                                       double min_found);

}  // namespace veneer::calib
