#include "calib/wood_colour.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr double kWorkPxPerMm = 6;
constexpr double kWarmer = 0.09;     // log(red / blue) by which wood exceeds board and lid
constexpr double kBlack = 4;         // grey levels added before a ratio is formed: the scanner's own black
constexpr double kOuterMargin = 12;  // mm of margin from which the board is learnt

double warmth(const cv::Vec3b& bgr) { return std::log((bgr[2] + kBlack) / (bgr[0] + kBlack)); }

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
  cv::Mat padded;
  cv::copyMakeBorder(map.pixels, padded, 0, below, 0, right, cv::BORDER_REPLICATE);
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

WoodColour WoodColour::learn(const WorkMap& work, const cv::Mat& fiducials) {
  const int margin = static_cast<int>(kOuterMargin * work.px_per_mm), skip = static_cast<int>(1.5 * work.px_per_mm);
  const cv::Mat darkest = darkest_channel(work.bgr);
  WoodColour colour;
  colour.white = top_level(darkest, 0.003);
  std::vector<double> board, lid;
  for (int r = 0; r < work.bgr.rows; r += 3)
    for (int c = 0; c < work.bgr.cols; c += 3) {
      const auto& pixel = work.bgr.at<cv::Vec3b>(r, c);
      const int low = darkest.at<std::uint8_t>(r, c), high = std::max({pixel[0], pixel[1], pixel[2]});
      if (low >= 0.92 * colour.white) lid.push_back(warmth(pixel));
      const int rim = std::min({r, c, work.bgr.rows - 1 - r, work.bgr.cols - 1 - c});
      // Of the margin what is neutral: strips may reach into it on another panel.
      if (rim > skip && rim < margin && fiducials.at<std::uint8_t>(r, c) == 0 && low < 0.85 * colour.white &&
          low > 0.8 * high)
        board.push_back(warmth(pixel));
    }
  colour.ratio = std::exp(
      std::max(board.size() > 100 ? median(std::move(board)) : 0.0, lid.size() > 100 ? median(std::move(lid)) : 0.0) +
      kWarmer);
  return colour;
}

bool WoodColour::is_lid(const cv::Vec3b& bgr) const { return std::min({bgr[0], bgr[1], bgr[2]}) > 0.93 * white; }

bool WoodColour::is_wood(const cv::Vec3b& bgr) const {
  return bgr[2] + kBlack > ratio * (bgr[0] + kBlack) && !is_lid(bgr);
}

cv::Mat WoodColour::wood(const cv::Mat& bgr) const {
  cv::Mat mask(bgr.size(), CV_8UC1);
  for (int r = 0; r < mask.rows; ++r)
    for (int c = 0; c < mask.cols; ++c) mask.at<std::uint8_t>(r, c) = is_wood(bgr.at<cv::Vec3b>(r, c)) ? 255 : 0;
  return mask;
}

cv::Mat WoodColour::lid(const cv::Mat& bgr) const {
  cv::Mat mask(bgr.size(), CV_8UC1);
  for (int r = 0; r < mask.rows; ++r)
    for (int c = 0; c < mask.cols; ++c) mask.at<std::uint8_t>(r, c) = is_lid(bgr.at<cv::Vec3b>(r, c)) ? 255 : 0;
  return mask;
}

}  // namespace veneer::calib
