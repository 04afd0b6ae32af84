// Which patch chooses first (paper, section 3.3 and figure 6).
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "planner/layout/grid.h"
#include "planner/plan.h"

namespace veneer::planner {

// Saliency after Montabone and Soto 2010, CV_32FC1, of the picture scaled to a shorter side of 512 px: the method's
// windows are fixed in pixels, so the order must not depend on the working resolution.
cv::Mat saliency_of(const cv::Mat& bgr);

// Maps of pictures, each made once: a plan, or several plans, may have the same picture many times. Not for
// several threads at a time.
class SaliencyMaps {
 public:
  // `bgr` must not be changed as long as this lives. Copies that share their pixels share their map.
  cv::Mat of(const cv::Mat& bgr);
  std::size_t size() const { return known_.size(); }

 private:
  struct Known {
    cv::Mat picture, map;
  };
  std::vector<Known> known_;
};

// One number a patch, the larger the earlier. Saliency: the map's sum over the patch, per mm2 so that patches of
// several artworks compare, multiplied by the artwork's importance point by point. Centre: minus the distance from the
// artwork's centre in mm. Neither depends on the working resolution.
std::vector<double> urgencies(const Artwork& artwork, const std::vector<Patch>& patches, Priority priority,
                              SaliencyMaps& maps);

// Mean importance of each patch, in [0, 1]; 1 where the artwork names none.
std::vector<double> importances(const Artwork& artwork, const std::vector<Patch>& patches);

// Indices by falling urgency; equal ones keep their order.
std::vector<std::size_t> by_urgency(const std::vector<double>& urgency);

}  // namespace veneer::planner
