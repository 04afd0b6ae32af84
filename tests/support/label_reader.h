// Reads the tags of panels' labels, of family Standard41h12, as a program of somebody else's would: nothing of ours but
// the picture.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace veneer::tests {

// Their numbers, in order. `grey` is CV_8UC1.
std::vector<int> label_tags_on(const cv::Mat& grey);

}  // namespace veneer::tests
