#include "planner/morph/edge_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "planner/layout/own_canny.h"
#include "planner/parallel.h"

namespace veneer::planner {
namespace {

constexpr int kGuidanceRounds = 4;            // after the guidance that is blurred
constexpr double kGuidanceRange = 25;         // grey levels
constexpr double kSmallStructure = 1.0 / 10;  // of the spacing: standard deviation of what is too small for a border
constexpr double kFineStructure = 1.0 / 20;   // of the spacing, for the bilateral filter
constexpr double kShortestEdge = 0.75;        // of the spacing: edges of a border's length
constexpr double kSteepestEdge = 0.75;        // a line follows edges that lean no farther than 1 / 0.75 across to along

// Gradients of `grey`, 3 x 3 Sobel.
struct Gradients {
  cv::Mat x, y;  // CV_16SC1
};
Gradients gradients_of(const cv::Mat& grey) {
  Gradients out;
  cv::Sobel(grey, out.x, CV_16S, 1, 0);
  cv::Sobel(grey, out.y, CV_16S, 0, 1);
  return out;
}

// Marks the edges of `grey` by their direction.
void mark_edges(const cv::Mat& grey, double shortest, EdgeKind upright, EdgeKind level, cv::Mat& out) {
  const cv::Mat edges = own_canny(grey, shortest);
  // Directions of a few pixels together: single ones turn by eighths.
  cv::Mat soft;
  cv::GaussianBlur(grey, soft, {}, 2);
  const Gradients gradients = gradients_of(soft);
  for (int r = 0; r < edges.rows; ++r)
    for (int c = 0; c < edges.cols; ++c) {
      if (edges.at<std::uint8_t>(r, c) == 0) continue;
      const double x = std::abs(gradients.x.at<std::int16_t>(r, c)), y = std::abs(gradients.y.at<std::int16_t>(r, c));
      if (x >= kSteepestEdge * y) out.at<std::uint8_t>(r, c) |= upright;
      if (y >= kSteepestEdge * x) out.at<std::uint8_t>(r, c) |= level;
    }
}

}  // namespace

cv::Mat rolling_guidance(const cv::Mat& grey, double space, double range, int threads) {
  const int reach = std::max(1, static_cast<int>(std::ceil(2 * space)));
  std::vector<float> near;  // weights of distances, a square of 2 reach + 1
  for (int y = -reach; y <= reach; ++y)
    for (int x = -reach; x <= reach; ++x)
      near.push_back(static_cast<float>(std::exp(-(x * x + y * y) / (2 * space * space))));
  std::array<float, 256> alike{};
  for (std::size_t d = 0; d < alike.size(); ++d)
    alike[d] = static_cast<float>(std::exp(-static_cast<double>(d * d) / (2 * range * range)));
  cv::Mat padded, guide;
  cv::copyMakeBorder(grey, padded, reach, reach, reach, reach, cv::BORDER_REFLECT_101);
  cv::GaussianBlur(grey, guide, {}, space);
  for (int round = 0; round < kGuidanceRounds; ++round) {
    cv::Mat padded_guide, next(grey.size(), CV_8UC1);
    cv::copyMakeBorder(guide, padded_guide, reach, reach, reach, reach, cv::BORDER_REFLECT_101);
    (void)run_parallel(static_cast<std::size_t>(grey.rows), threads, {}, [&](std::size_t number) {
      const int r = static_cast<int>(number);
      for (int c = 0; c < grey.cols; ++c) {
        const int here = guide.at<std::uint8_t>(r, c);
        float sum = 0, weights = 0;
        const float* distance = near.data();
        for (int y = 0; y <= 2 * reach; ++y) {
          const std::uint8_t* values = padded.ptr<std::uint8_t>(r + y) + c;
          const std::uint8_t* guides = padded_guide.ptr<std::uint8_t>(r + y) + c;
          for (int x = 0; x <= 2 * reach; ++x) {
            const float weight = *distance++ * alike[static_cast<std::size_t>(std::abs(guides[x] - here))];
            sum += weight * static_cast<float>(values[x]), weights += weight;
          }
        }
        next.at<std::uint8_t>(r, c) = cv::saturate_cast<std::uint8_t>(sum / weights);
      }
    });
    guide = next;
  }
  return guide;
}

bool EdgeImage::empty() const { return cv::countNonZero(upright) == 0 && cv::countNonZero(level) == 0; }

cv::Mat all_edges(const cv::Mat& bgr, double spacing, int threads) {
  cv::Mat out(bgr.size(), CV_8UC1, cv::Scalar(0)), grey, smooth;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  mark_edges(rolling_guidance(grey, std::max(1.0, kSmallStructure * spacing), kGuidanceRange, threads),
             kShortestEdge * spacing, kLargeUpright, kLargeLevel, out);
  cv::bilateralFilter(grey, smooth, 0, kGuidanceRange, std::max(1.0, kFineStructure * spacing));
  mark_edges(smooth, kShortestEdge * spacing, kFineUpright, kFineLevel, out);
  return out;
}

EdgeImage edges_that_count(const cv::Mat& all, const EdgeMasks& masks) {
  cv::Mat large = all & (kLargeUpright | kLargeLevel), fine = all & (kFineUpright | kFineLevel);
  if (!masks.large.empty()) large.setTo(0, masks.large == 0);
  if (!masks.fine.empty()) fine.setTo(0, masks.fine == 0);
  const cv::Mat counting = large | fine;
  return {(counting & (kLargeUpright | kFineUpright)) != 0, (counting & (kLargeLevel | kFineLevel)) != 0};
}

EdgeImage edge_image(const cv::Mat& bgr, double spacing, int threads, const EdgeMasks& masks) {
  return edges_that_count(all_edges(bgr, spacing, threads), masks);
}

}  // namespace veneer::planner
