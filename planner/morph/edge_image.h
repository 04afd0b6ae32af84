// The edges that a morphed grid is to follow (paper, section 3.4, equation 5).
//
// E_RG comes of the picture without small structures (rolling guidance, Zhang et al. 2014), E_bilateral of the picture
// without noise; both after Canny 1986, with thresholds from the picture's own gradients. Pure functions; thread-safe.
#pragma once

#include <functional>
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

// The same in two steps. The first takes nearly all of the time and knows no masks, so that what it gives may be kept
// for the next grid over the same pixels. CV_8UC1, bits of EdgeKind.
enum EdgeKind : unsigned char { kLargeUpright = 1, kLargeLevel = 2, kFineUpright = 4, kFineLevel = 8 };
cv::Mat all_edges(const cv::Mat& bgr, double spacing, int threads);
EdgeImage edges_that_count(const cv::Mat& all, const EdgeMasks& masks);

// What all_edges() gives: itself, or whoever keeps it.
using EdgeFinder = std::function<cv::Mat(const cv::Mat& bgr, double spacing, int threads)>;

// Which filters all_edges() is: another number whenever it gives other edges of some picture.
inline constexpr int kEdgeFilters = 1;

}  // namespace veneer::planner
