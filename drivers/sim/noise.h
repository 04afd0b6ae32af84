// Smooth random fields, the stuff wood and light are made of.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "drivers/sim/random.h"

namespace veneer::sim {

// A smooth field of `size` pixels (CV_32FC1, about -1 to 1, zero mean) whose lumps are `cell_x` by `cell_y` pixels.
cv::Mat noise_field(Random& random, cv::Size size, double cell_x, double cell_y);

// Smooth noise along a line, periodic in nothing: value at any x >= 0 for lumps of length 1.
class LineNoise {
 public:
  LineNoise(Random& random, int lumps);
  double at(double x) const;  // about -1 to 1

 private:
  std::vector<float> knots_;
};

}  // namespace veneer::sim
