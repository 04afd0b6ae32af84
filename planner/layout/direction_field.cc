#include "planner/layout/direction_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "planner/layout/own_canny.h"

namespace veneer::planner {
namespace {

constexpr double kShortest = 1.5;  // tiles

}  // namespace

cv::Mat salient_edges(const cv::Mat& bgr, double tile) {
  // The bilateral filter keeps edges where a Gaussian would move them; what is finer than a tile goes with both.
  cv::Mat smooth, softer;
  cv::bilateralFilter(bgr, smooth, 0, 40, std::max(1.0, tile / 8));
  cv::GaussianBlur(smooth, softer, {}, std::max(0.8, tile / 12));
  cv::Mat grey;
  cv::cvtColor(softer, grey, cv::COLOR_BGR2GRAY);
  return own_canny(grey, kShortest * tile);
}

DirectionField direction_field(const cv::Mat& edges, double smoothing) {
  DirectionField out;
  cv::distanceTransform(~edges, out.distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat with_border = ~edges;
  cv::rectangle(with_border, cv::Rect({0, 0}, edges.size()), cv::Scalar(0));
  cv::Mat distance, dx, dy;
  cv::distanceTransform(with_border, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Sobel(distance, dx, CV_32F, 1, 0);
  cv::Sobel(distance, dy, CV_32F, 0, 1);
  // Quarter turns fall together when angles are taken four times, and such directions can be averaged.
  cv::Mat cosine(edges.size(), CV_32FC1), sine(edges.size(), CV_32FC1);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c) {
      const float x = dx.at<float>(r, c), y = dy.at<float>(r, c);
      const float angle = 4 * std::atan2(y, x);
      const float is_known = x == 0 && y == 0 ? 0 : 1;  // not on an edge itself
      cosine.at<float>(r, c) = is_known * std::cos(angle), sine.at<float>(r, c) = is_known * std::sin(angle);
    }
  cv::GaussianBlur(cosine, cosine, {}, std::max(0.8, smoothing));
  cv::GaussianBlur(sine, sine, {}, std::max(0.8, smoothing));
  out.angle.create(edges.size(), CV_32FC1);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c)
      out.angle.at<float>(r, c) = std::atan2(sine.at<float>(r, c), cosine.at<float>(r, c)) / 4;
  return out;
}

}  // namespace veneer::planner
