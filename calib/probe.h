// Small ways to look at an 8 bit picture, shared by the detectors. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace veneer::calib {

// The darkest of a pixel's channels: the lid is bright in all of them, wood and plywood are not.
cv::Mat darkest_channel(const cv::Mat& picture);

// The grey level that all but `fraction` of the pixels stay at or below.
int top_level(const cv::Mat& grey, double fraction);

// Bilinear; pixel centres at +0.5. Outside the picture its border counts.
double level_at(const cv::Mat& grey, double x, double y);

// The upper one of two middle values; 0 without any.
double median(std::vector<double> values);

}  // namespace veneer::calib
