// Measures how wide the laser cuts, from a scan of a board with straight lines cut through.
//
// Across a line the colour goes from the board's over soot and a browned rim to the lid's, seen dimly through the slit,
// and back; the scanner blurs all of it. Blur, soot, rim and levels are fitted together with the width, on profiles
// sampled finer than the pixels, so none of them has to be known; only where a rim cannot be told from the soot beside
// it, about 0.1 mm is taken for likely. The width is what is open from face to face, which of a cut that narrows
// through the board is that at the far face. Lines are found as a constellation: the board may lie on the glass
// anywhere, at any angle, on either face.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "base/calibration_pattern.h"
#include "base/result.h"

namespace veneer::calib {

struct KerfReading {
  std::size_t line = 0;   // index into the lines given
  Millimetres width{0};   // full width k
  Millimetres spread{0};  // one sigma along the line, of 4 mm pieces
  bool along_x = false;   // the line runs along machine x (so the width is measured across, in y)
  double misfit = 0;      // rms, grey levels, of what model and scan differ by
};

struct KerfMeasurement {
  Millimetres mean{0};                           // of the two means below, where both directions were read
  Millimetres spread{0};                         // one sigma between lines
  Millimetres mean_x_lines{0}, mean_y_lines{0};  // along machine x, along y; lines with a greater misfit count less
  std::vector<KerfReading> readings;
};

struct KerfLimits {
  Millimetres min{0.05}, max{0.80};
  Millimetres max_spread{0.04};
  double min_found = 0.75;  // fraction of the lines
};

// `resolution` is the scan's true one (from the scanner's certificate); 300 dpi or more. `scan` is BGR, 8 bit.
// kNotFound when the lines are not seen, kRefused when the widths are out of limits or disagree.
Result<KerfMeasurement> measure_kerf(const cv::Mat& scan, ScanResolution resolution, std::span<const KerfLine> lines,
                                     const KerfLimits& limits = {});

}  // namespace veneer::calib
