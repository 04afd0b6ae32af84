// The colours of a strip's wood: which are its own, and the line of its pigment. Internal to veneer_mask. Thread-safe.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "calib/board_model.h"

namespace veneer::calib {

// Colours that are seen all over a strip, with those close to them. A crack shows its colour in many places, but along
// one line only, and so has none.
class OwnColours {
 public:
  // `strip` is 255 on one strip, and `box` holds it.
  OwnColours(const BoardView& view, const cv::Mat& strip, const cv::Rect& box);
  bool has(const BoardView& view, int row, int column) const;

 private:
  std::vector<std::uint8_t> own_;  // 1 = is one, by steps of the planes
};

// The line along which a wood's colours lie: figure is more or less of one pigment, which in logarithms of light is one
// direction (Lambert and Beer). A hole's black, a head's metal and the lid lie beside it, or much farther along it.
class PigmentLine {
 public:
  // Of the whole strip, or of those of its colours that are `own`.
  PigmentLine(const BoardView& view, const cv::Mat& strip, const cv::Rect& box, const OwnColours* own = nullptr);
  bool holds(const BoardView& view, int row, int column) const;

 private:
  cv::Vec3f middle_{0, 0, 0}, along_{1, 0, 0};
  double along_spread_ = 0, beside_spread_ = 0;
};

}  // namespace veneer::calib
