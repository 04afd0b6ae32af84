#include "calib/screw_finder.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "calib/radial.h"

namespace veneer::calib {
namespace {

constexpr double kSearchPxPerMm = 3;
constexpr double kMinRays = 0.85;
constexpr double kDarker = 0.72;  // a hole against its surroundings
constexpr double kBlack = 6;      // grey levels that noise and the scanner's black leave of a ratio in dark wood

cv::Mat disc(double inner_px, double outer_px) {
  const int half = static_cast<int>(std::ceil(outer_px));
  cv::Mat kernel = cv::Mat::zeros(2 * half + 1, 2 * half + 1, CV_32FC1);
  for (int r = -half; r <= half; ++r)
    for (int c = -half; c <= half; ++c) {
      const double d = std::hypot(c, r);
      if (d <= outer_px && d >= inner_px) kernel.at<float>(r + half, c + half) = 1;
    }
  return kernel / cv::sum(kernel)[0];
}

// Places that are darker than the ring around them, darkest first.
std::vector<cv::Point> dark_spots(const cv::Mat& light, const cv::Mat& wood, const MaskOptions& options, double px) {
  const double smallest = options.screw_diameter_min.count() / 2 * px,
               largest = options.screw_diameter_max.count() / 2 * px;
  cv::Mat inside, around;
  cv::filter2D(light, inside, CV_32F, disc(0, 0.85 * smallest));
  cv::filter2D(light, around, CV_32F, disc(largest + 0.5 * px, largest + 1.8 * px));
  cv::Mat score = (inside + kBlack) / (around + kBlack), lowest;
  const int reach = static_cast<int>(std::ceil(largest));
  cv::erode(score, lowest, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * reach + 1, 2 * reach + 1}));
  std::vector<std::pair<float, cv::Point>> found;
  for (int r = 0; r < score.rows; ++r)
    for (int c = 0; c < score.cols; ++c) {
      const float s = score.at<float>(r, c);
      if (s < kDarker && s == lowest.at<float>(r, c) && wood.at<std::uint8_t>(r, c) != 0) found.push_back({s, {c, r}});
    }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<cv::Point> spots;
  spots.reserve(found.size());
  for (const auto& [s, p] : found) spots.push_back(p);
  return spots;
}

// Whether the inside is clearly darker than a ring around the rim, and that ring is mostly wood.
bool is_hole(const cv::Mat& light, const cv::Mat& wood, const RoundFit& fit, double px_per_mm) {
  std::vector<double> inside, around;
  int on_wood = 0, places = 0;
  const int reach = static_cast<int>(fit.rim + 1.5 * px_per_mm) + 1;
  const int middle_c = static_cast<int>(fit.centre.x()), middle_r = static_cast<int>(fit.centre.y());
  for (int r = std::max(0, middle_r - reach); r <= std::min(light.rows - 1, middle_r + reach); ++r)
    for (int c = std::max(0, middle_c - reach); c <= std::min(light.cols - 1, middle_c + reach); ++c) {
      const double d = std::hypot(c + 0.5 - fit.centre.x(), r + 0.5 - fit.centre.y());
      if (d < 0.75 * fit.rim) inside.push_back(light.at<std::uint8_t>(r, c));
      if (d < fit.rim + 0.5 * px_per_mm || d > fit.rim + 1.5 * px_per_mm) continue;
      around.push_back(light.at<std::uint8_t>(r, c));
      ++places, on_wood += wood.at<std::uint8_t>(r, c) != 0 ? 1 : 0;
    }
  if (inside.size() < 4 || around.size() < 4 || on_wood < 0.8 * places) return false;
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  std::sort(inside.begin(), inside.end());
  return (median(inside) + kBlack) < kDarker * (median(around) + kBlack);
}

}  // namespace

std::vector<ScrewSpot> find_screws(const cv::Mat& bgr, const cv::Mat& wood, double px_per_mm,
                                   const MaskOptions& options) {
  cv::Mat light, small, small_wood;
  cv::cvtColor(bgr, light, cv::COLOR_BGR2GRAY);
  const double shrink = std::min(1.0, kSearchPxPerMm / px_per_mm), px = px_per_mm * shrink;
  cv::resize(light, small, {}, shrink, shrink, cv::INTER_AREA);
  // Inside a hole there is no wood: its surroundings count.
  cv::resize(wood, small_wood, small.size(), 0, 0, cv::INTER_NEAREST);
  const int reach = static_cast<int>(options.screw_diameter_max.count() * px);
  cv::morphologyEx(small_wood, small_wood, cv::MORPH_CLOSE,
                   cv::getStructuringElement(cv::MORPH_ELLIPSE, {reach | 1, reach | 1}));
  std::vector<ScrewSpot> screws;
  for (const cv::Point& spot : dark_spots(small, small_wood, options, px)) {
    const Eigen::Vector2d centre((spot.x + 0.5) / shrink, (spot.y + 0.5) / shrink);
    const RoundFit fit = fit_round(light, centre,
                                   {.rim_from = options.screw_diameter_min.count() / 2 * px_per_mm,
                                    .rim_to = options.screw_diameter_max.count() / 2 * px_per_mm,
                                    .inside = 0.5 * px_per_mm,
                                    .outside = 0.4 * px_per_mm,
                                    .stray_limit = 0.35 * px_per_mm,
                                    .min_slope = 1.5});
    if (fit.rim == 0 || fit.brighter_inside || fit.seen < kMinRays) continue;
    if ((fit.centre - centre).norm() > 1.5 * px_per_mm) continue;
    if (!is_hole(light, wood, fit, px_per_mm)) continue;
    const cv::Point2d at(fit.centre.x(), fit.centre.y());
    const bool known = std::any_of(screws.begin(), screws.end(), [&](const ScrewSpot& s) {
      return std::hypot(s.centre.x - at.x, s.centre.y - at.y) < 2 * px_per_mm;
    });
    if (!known) screws.push_back({at, 2 * fit.rim});
  }
  return screws;
}

}  // namespace veneer::calib
