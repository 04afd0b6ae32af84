#include "planner/layout/direction_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace veneer::planner {
namespace {

// Of the gradients that are no noise, the share that is strong enough to begin an edge.
constexpr double kStrong = 0.85;
constexpr double kWeak = 0.4;          // threshold of what continues an edge, in that of what begins one
constexpr double kLeastGradient = 12;  // of 255 over a pixel, after smoothing: 3 x 3 Sobel
constexpr double kShortest = 1.5;      // tiles

// The value that this share of the non-zero ones does not exceed.
double quantile(const cv::Mat& values, double share) {
  std::vector<float> all;
  for (int r = 0; r < values.rows; ++r)
    for (int c = 0; c < values.cols; ++c)
      if (const float v = values.at<float>(r, c); static_cast<double>(v) > kLeastGradient) all.push_back(v);
  if (all.empty()) return kLeastGradient;
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::nth_element(all.begin(), at, all.end());
  return static_cast<double>(*at);
}

}  // namespace

cv::Mat salient_edges(const cv::Mat& bgr, double tile) {
  // The bilateral filter keeps edges where a Gaussian would move them; what is finer than a tile goes with both.
  cv::Mat smooth, softer, dx, dy, edges;
  cv::bilateralFilter(bgr, smooth, 0, 40, std::max(1.0, tile / 8));
  cv::GaussianBlur(smooth, softer, {}, std::max(0.8, tile / 12));
  cv::Mat grey;
  cv::cvtColor(softer, grey, cv::COLOR_BGR2GRAY);
  cv::Sobel(grey, dx, CV_16S, 1, 0);
  cv::Sobel(grey, dy, CV_16S, 0, 1);
  cv::Mat fx, fy, strength;
  dx.convertTo(fx, CV_32F), dy.convertTo(fy, CV_32F);
  cv::magnitude(fx, fy, strength);
  const double high = quantile(strength, kStrong);
  cv::Canny(dx, dy, edges, kWeak * high, high, true);
  cv::Mat numbers, figures, centres;
  const int count = cv::connectedComponentsWithStats(edges, numbers, figures, centres, 8, CV_32S);
  for (int k = 1; k < count; ++k)
    if (figures.at<int>(k, cv::CC_STAT_AREA) < kShortest * tile) edges.setTo(0, numbers == k);
  return edges;
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
