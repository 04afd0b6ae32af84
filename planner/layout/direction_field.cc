#include "planner/layout/direction_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "planner/layout/own_canny.h"

namespace veneer::planner {
namespace {

constexpr double kShortest = 1.5;  // tiles

// The mean direction around each pixel, of directions (x, y) that are known up to the n-th part of a turn: angles fall
// together when they are taken n times. In (-pi / n, pi / n].
cv::Mat mean_direction(const cv::Mat& x, const cv::Mat& y, float n, double smoothing) {
  cv::Mat cosine(x.size(), CV_32FC1), sine(x.size(), CV_32FC1), out(x.size(), CV_32FC1);
  for (int r = 0; r < x.rows; ++r)
    for (int c = 0; c < x.cols; ++c) {
      const float along = x.at<float>(r, c), down = y.at<float>(r, c);
      const float angle = n * std::atan2(down, along);
      const float is_known = along == 0 && down == 0 ? 0 : 1;  // not on an edge itself
      cosine.at<float>(r, c) = is_known * std::cos(angle), sine.at<float>(r, c) = is_known * std::sin(angle);
    }
  cv::GaussianBlur(cosine, cosine, {}, std::max(0.8, smoothing));
  cv::GaussianBlur(sine, sine, {}, std::max(0.8, smoothing));
  for (int r = 0; r < x.rows; ++r)
    for (int c = 0; c < x.cols; ++c) out.at<float>(r, c) = std::atan2(sine.at<float>(r, c), cosine.at<float>(r, c)) / n;
  return out;
}

// Of an axis and the one a quarter turn from it, the one that is nearer to `direction`, which is known up to half
// turns.
float nearer_axis(float angle, float direction) {
  constexpr auto kHalf = static_cast<float>(std::numbers::pi), kQuarter = kHalf / 2;
  if (std::abs(std::remainder(direction - angle, kHalf)) <= kQuarter / 2) return angle;
  return angle > 0 ? angle - kQuarter : angle + kQuarter;
}

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
  out.angle = mean_direction(dx, dy, 4, smoothing);
  // The sides of long tiles lie where those of square ones do; where the nearest edge changes, only which of them is
  // the long one changes, so that rows of tiles meet there and none is aslant.
  out.across = mean_direction(dx, dy, 2, smoothing);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c)
      out.across.at<float>(r, c) = nearer_axis(out.angle.at<float>(r, c), out.across.at<float>(r, c));
  return out;
}

}  // namespace veneer::planner
