#include "planner/layout/tone_areas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace veneer::planner {
namespace {

constexpr double kDetail = 0.4;  // patches: what is smaller than this is smoothed away
constexpr int kMeansRounds = 50;

}  // namespace

std::vector<int> tone_groups(const std::array<double, 256>& histogram, int groups) {
  const auto count = static_cast<std::size_t>(std::max(1, groups));
  // The best groups are about as dense as the cube root of what is there (Panter and Dite), so that a large plain
  // ground does not get all of them.
  double all = 0;
  for (const double n : histogram) all += std::cbrt(n);
  std::vector<double> means;
  double below = 0;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    below += std::cbrt(histogram[i]);
    while (means.size() < count && below > all * (static_cast<double>(means.size()) + 0.5) / static_cast<double>(count))
      means.push_back(static_cast<double>(i));
  }
  means.erase(std::unique(means.begin(), means.end()), means.end());
  std::vector<int> ends;
  for (int round = 0; round < kMeansRounds; ++round) {
    std::vector<int> now;
    for (std::size_t g = 0; g + 1 < means.size(); ++g) now.push_back(static_cast<int>((means[g] + means[g + 1]) / 2));
    now.push_back(255);
    if (now == ends) break;
    ends = std::move(now);
    int from = 0;
    for (std::size_t g = 0; g < means.size(); ++g) {
      double sum = 0, weight = 0;
      for (int v = from; v <= ends[g]; ++v)
        sum += v * histogram[static_cast<std::size_t>(v)], weight += histogram[static_cast<std::size_t>(v)];
      if (weight > 0) means[g] = sum / weight;
      from = ends[g] + 1;
    }
  }
  return ends;
}

cv::Mat tone_areas(const cv::Mat& bgr, double patch, int groups) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  const int window = static_cast<int>(std::lround(kDetail * patch)) | 1;
  if (window > 1)
    for (int k = 0; k < 2; ++k) cv::medianBlur(grey, grey, window);
  std::array<double, 256> histogram{};
  for (const std::uint8_t v : cv::Mat_<std::uint8_t>(grey)) ++histogram[v];
  const std::vector<int> ends = tone_groups(histogram, groups);
  cv::Mat out(grey.size(), CV_32SC1);
  for (int r = 0; r < grey.rows; ++r)
    for (int c = 0; c < grey.cols; ++c)
      out.at<int>(r, c) = static_cast<int>(
          std::lower_bound(ends.begin(), ends.end(), static_cast<int>(grey.at<std::uint8_t>(r, c))) - ends.begin());
  return out;
}

}  // namespace veneer::planner
