// Light over the bed as it is in a workshop: other at each picture, with slopes, glare and shadows, and a camera that
// makes up for some of it by itself.
//
// Pure functions; use all cores.
#pragma once

#include <opencv2/core/mat.hpp>

#include "drivers/sim/random.h"
#include "drivers/sim/roughness.h"

namespace veneer::sim {

// Changes a BGR picture as `random` draws. Does nothing where the roughness says of no light.
void light_the_bed(cv::Mat& picture, const Roughness& rough, Random& random);

}  // namespace veneer::sim
