// How much of a panel's wood a scan shows too light or too dark to tell its grain. Thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::calib {

// Shares of the wood, 0 to 1.
struct Exposure {
  double blown = 0;  // a channel is at its upper end there: what is lighter looks the same
  double sunk = 0;   // all channels are at their lower end
};

// `map` is CV_8UC3; `usable`, of its size, is not 0 on wood. Nothing is blown or sunk where there is none.
Exposure measure_exposure(const cv::Mat& map, const cv::Mat& usable);

}  // namespace veneer::calib
