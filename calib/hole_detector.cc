#include "calib/hole_detector.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/probe.h"
#include "calib/radial.h"

namespace veneer::calib {
namespace {

constexpr double kSearchPxPerMm = 4;  // resolution at which bright spots are looked for

// Bright round spots of about the wanted size, in full-resolution pixels.
std::vector<Eigen::Vector2d> bright_spots(const cv::Mat& small, double scale, double diameter_px, double white) {
  std::vector<Eigen::Vector2d> spots;
  for (const double share : {0.62, 0.72, 0.80, 0.88}) {
    const cv::Mat mask = small >= share * white;
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(mask, labels, stats, centres, 4);
    for (int i = 1; i < count; ++i) {
      const int w = stats.at<int>(i, cv::CC_STAT_WIDTH), h = stats.at<int>(i, cv::CC_STAT_HEIGHT);
      const double fill = stats.at<int>(i, cv::CC_STAT_AREA) / static_cast<double>(w * h);
      if (std::max(w, h) > 1.3 * diameter_px || std::min(w, h) < 0.5 * diameter_px) continue;
      if (std::max(w, h) > 1.35 * std::min(w, h) || fill < 0.62 || fill > 0.92) continue;
      const Eigen::Vector2d at((centres.at<double>(i, 0) + 0.5) * scale, (centres.at<double>(i, 1) + 0.5) * scale);
      const bool known = std::any_of(spots.begin(), spots.end(), [&](const Eigen::Vector2d& s) {
        return (s - at).norm() < 0.5 * diameter_px * scale;
      });
      if (!known) spots.push_back(at);
    }
  }
  return spots;
}

// Whether the lid is seen inside: bright, and without colour.
bool shows_lid(const cv::Mat& picture, const cv::Point& middle, double radius, double white) {
  const int half = static_cast<int>(radius * 0.35);
  const cv::Rect box = cv::Rect(middle.x - half, middle.y - half, 2 * half + 1, 2 * half + 1) &
                       cv::Rect(0, 0, picture.cols, picture.rows);
  if (box.empty()) return false;
  const cv::Scalar mean = cv::mean(picture(box));
  const double low = picture.channels() == 1 ? mean[0] : std::min({mean[0], mean[1], mean[2]});
  const double high = picture.channels() == 1 ? mean[0] : std::max({mean[0], mean[1], mean[2]});
  return low > 0.8 * white && low > 0.9 * high;
}

}  // namespace

std::vector<Hole> detect_holes(const cv::Mat& picture, ScanResolution resolution, const HoleOptions& options) {
  if (picture.empty() || (picture.type() != CV_8UC1 && picture.type() != CV_8UC3)) return {};
  const double px_per_mm = resolution.px_per_mm, radius = resolution.to_px(options.diameter).count() / 2;
  const double shrink = std::min(1.0, kSearchPxPerMm / px_per_mm);
  cv::Mat small;
  cv::resize(picture, small, {}, shrink, shrink, cv::INTER_AREA);
  small = darkest_channel(small);
  const double white = top_level(small, 0.002);
  const double scale = static_cast<double>(picture.cols) / small.cols;

  std::vector<Hole> holes;
  for (Eigen::Vector2d centre : bright_spots(small, scale, 2 * radius / scale, white)) {
    // A piece of the picture that holds the hole and its surroundings.
    const int reach = static_cast<int>(radius * 1.7) + 4;
    const cv::Rect box =
        cv::Rect(static_cast<int>(centre.x()) - reach, static_cast<int>(centre.y()) - reach, 2 * reach, 2 * reach) &
        cv::Rect(0, 0, picture.cols, picture.rows);
    if (box.width < 2 * radius || box.height < 2 * radius) continue;
    if (!shows_lid(picture, {static_cast<int>(centre.x()), static_cast<int>(centre.y())}, radius, white)) continue;
    const cv::Mat grey = darkest_channel(picture(box));
    const Eigen::Vector2d shift(box.x, box.y);
    Eigen::Vector2d local = centre - shift;
    const double tolerance = options.diameter_tolerance;
    const RoundFit fit = fit_round(grey, local,
                                   {.rim_from = radius * (1 - tolerance),
                                    .rim_to = radius * (1 + tolerance),
                                    .inside = 0.5 * px_per_mm,
                                    .outside = 0.3 * px_per_mm,
                                    .stray_limit = std::max(1.0, 0.15 * px_per_mm)});
    if (fit.rim == 0 || (fit.centre - local).norm() > radius) continue;
    if (fit.seen < options.min_rim_seen || fit.rms > resolution.to_px(options.max_rim_rms).count()) continue;
    local = fit.centre;
    const double rim = fit.rim;
    centre = local + shift;
    if (centre.x() < rim || centre.y() < rim || centre.x() > picture.cols - rim || centre.y() > picture.rows - rim)
      continue;
    holes.push_back({point<ScanFrame>(centre.x(), centre.y()), Pixels(2 * rim), Pixels(fit.rms), fit.seen});
  }
  std::sort(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.centre.x < b.centre.x; });
  return holes;
}

}  // namespace veneer::calib
