#include "calib/work_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::calib {
namespace {

constexpr double kWorkPxPerMm = 6;

}  // namespace

cv::Mat round_kernel(double radius_px) {
  const int half = std::max(1, static_cast<int>(std::lround(radius_px)));
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * half + 1, 2 * half + 1});
}

WorkMap shrink(const Raster<PanelFrame>& map) {
  WorkMap work;
  work.fold = std::max(1, static_cast<int>(std::lround(map.resolution.px_per_mm / kWorkPxPerMm)));
  work.px_per_mm = map.resolution.px_per_mm / work.fold;
  const int right = (work.fold - map.pixels.cols % work.fold) % work.fold;
  const int below = (work.fold - map.pixels.rows % work.fold) % work.fold;
  cv::Mat padded = map.pixels;  // a large map is copied only where it must be
  if (right > 0 || below > 0) cv::copyMakeBorder(map.pixels, padded, 0, below, 0, right, cv::BORDER_REPLICATE);
  cv::resize(padded, work.bgr, {padded.cols / work.fold, padded.rows / work.fold}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(work.bgr, work.bgr, {}, 0.1 * work.px_per_mm);
  return work;
}

cv::Mat mark_fiducials(const Raster<PanelFrame>& map, const PanelFiducials& fiducials, const WorkMap& work,
                       Millimetres margin) {
  cv::Mat mask = cv::Mat::zeros(work.bgr.size(), CV_8UC1);
  const auto at = [&](const Point<PanelFrame>& p) {
    double c = 0, r = 0;
    map.to_pixels(p, c, r);
    return cv::Point2d(c / work.fold, r / work.fold);
  };
  for (const PanelTag& tag : fiducials.tags) {
    if (tag.face != Face::kShow) continue;
    std::vector<cv::Point2d> corners;
    cv::Point2d middle(0, 0);
    for (const auto& corner : tag.corners) corners.push_back(at(corner)), middle += corners.back() / 4.0;
    std::vector<cv::Point> grown;
    for (const auto& corner : corners) {
      // A quiet zone of one cell (an eighth of the side), and the margin.
      const cv::Point2d out = corner - middle;
      const double reach = std::hypot(out.x, out.y);
      const double more = reach * 0.25 + margin.count() * work.px_per_mm * 1.414;
      grown.emplace_back(middle + out * ((reach + more) / reach));
    }
    cv::fillConvexPoly(mask, grown, cv::Scalar(255));
  }
  for (const PanelHole& hole : fiducials.holes)
    cv::circle(mask, at(hole.centre), static_cast<int>((hole.diameter / 2 + margin).count() * work.px_per_mm) + 1,
               cv::Scalar(255), cv::FILLED);
  return mask;
}

}  // namespace veneer::calib
