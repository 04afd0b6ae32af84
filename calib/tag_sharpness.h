// How sharply a scan shows the rims of its tags, which are printed in black on white whatever board and wood are. A
// sheet that stands off the glass is blurred there, and so is all of it where the glass is fogged. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/frames.h"
#include "base/units.h"
#include "calib/tag_detector.h"

namespace veneer::calib {

struct TagSharpness {
  int id = -1;
  // Standard deviation of the Gaussian that would blur a perfect rim as much as this one is, pixels included (0.75 of
  // one on a sharp scan), along the worse of the tag's two axes. Of two opposite sides the sharper one counts, for
  // something may lie on the other.
  Millimetres blur{0};
};

// `picture` is 8 bit, grey or BGR. A tag without a rim that can be measured is left out.
std::vector<TagSharpness> measure_sharpness(const cv::Mat& picture, const std::vector<Tag<ScanFrame>>& tags,
                                            ScanResolution resolution);

}  // namespace veneer::calib
