// Finds the rings of the calibration pattern (base/calibration_pattern.h) that the laser burnt into a pale board, and
// knows which is which.
//
// Where the bed's origin lies is not known yet, so rings are found everywhere in the picture and matched as a
// constellation: any shift, any turn, never mirrored.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "base/calibration_pattern.h"
#include "base/result.h"
#include "calib/camera_model.h"

namespace veneer::calib {

struct FoundRing {
  std::size_t ring = 0;  // index into the pattern
  Point<MachineFrame> commanded;
  Point<BedFrame> centre;  // by the camera model given
  Millimetres diameter{0};
  Millimetres scatter{0};  // rms of the line's radius about the circle
};

struct BurntPatternOptions {
  Millimetres search_from_x{-120}, search_from_y{-120};  // of the camera model's (provisional) bed frame
  Millimetres search_to_x{640}, search_to_y{500};
  double min_found = 0.8;  // fraction of the rings that must be seen
};

// `height` is the board's thickness plus what lies under it. kNotFound when too few rings are seen, kRefused when two
// ways of laying the pattern fit alike.
Result<std::vector<FoundRing>> find_burnt_pattern(const cv::Mat& picture, const CameraModel& model, Millimetres height,
                                                  std::span<const PatternRing> pattern,
                                                  const BurntPatternOptions& options = {});

}  // namespace veneer::calib
