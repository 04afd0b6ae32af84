// What a sensor adds to light: unevenness and noise.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "drivers/sim/random.h"

namespace veneer::sim {

// Looks of a place on a sheet: wood darkened by engraving.
inline cv::Vec3f burnt_colour(const cv::Vec3b& wood, unsigned char engraved) {
  const float e = static_cast<float>(engraved) / 255.0F * 0.92F;
  return {static_cast<float>(wood[0]) * (1 - e) + 20 * e, static_cast<float>(wood[1]) * (1 - e) + 25 * e,
          static_cast<float>(wood[2]) * (1 - e) + 33 * e};
}

// Multiplies by light (one float per column times one per row) and adds Gaussian noise of `sigma` grey levels.
void light_and_noise(cv::Mat& picture, const std::vector<float>& column_light, const std::vector<float>& row_light,
                     double sigma, Random& random);

}  // namespace veneer::sim
