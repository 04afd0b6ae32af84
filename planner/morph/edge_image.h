// The edges that a morphed grid is to follow (paper, section 3.4, equation 5).
//
// E_RG comes of the picture without small structures (rolling guidance, Zhang et al. 2014), E_bilateral of the picture
// without noise; both after Canny 1986, with thresholds from the picture's own gradients. Pure functions; thread-safe.
#pragma once

#include <opencv2/core/mat.hpp>

namespace veneer::planner {

// The rolling guidance filter: structures much smaller than `space` pixels go, edges of what is larger stay where they
// are. CV_8UC1 in and out; `range`: grey levels that count as alike.
//
// OpenCV has it in ximgproc, which takes a hundred milliseconds to load with all that it needs, at every start of every
// program of ours; hence our own.
cv::Mat rolling_guidance(const cv::Mat& grey, double space, double range, int threads);

// E = max(M_RG E_RG, M_bilateral E_bilateral).
struct EdgeImage {
  // CV_8UC1, 255 on lines one pixel wide. An upright line of the grid can follow edges in `upright`, a level one those
  // in `level`; slanted edges are in both.
  cv::Mat upright, level;

  bool empty() const;
};

// Which edges count, CV_8UC1 of the picture's size: not 0. Empty: all of them.
struct EdgeMasks {
  cv::Mat large{}, fine{};  // M_RG, M_bilateral
};

// `bgr`: CV_8UC3. `spacing`: of the grid, pixels; what is much finer is no edge.
EdgeImage edge_image(const cv::Mat& bgr, double spacing, int threads, const EdgeMasks& masks = {});

}  // namespace veneer::planner
