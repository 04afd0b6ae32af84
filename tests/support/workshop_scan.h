// What a scanner makes of a sheet that was painted.
#pragma once

#include <opencv2/core.hpp>

#include "tests/support/workshop_panel.h"

namespace veneer::workshop {

struct PaintedSheet {
  cv::Mat picture;  // CV_32FC3, BGR
  double px = 0;    // of it, for each millimetre
  cv::Vec3f lid;    // the lid's colour
};

// Writes scan, resolution, scan_from_sheet, hairs and hair of `panel`, which knows its size and matter already.
void scan_sheet(const PaintedSheet& sheet, const Order& order, cv::RNG& random, Panel& panel);

}  // namespace veneer::workshop
