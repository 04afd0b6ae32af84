// The second picture of the demo: a moth, such as Grace Hopper's people found in a relay and taped into the log book.
// It is of few tones and bold shapes, so that ninety pieces of what is left of the wood show it.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::tests {

cv::Mat moth_picture();  // CV_8UC3, 480 x 384

}  // namespace veneer::tests
