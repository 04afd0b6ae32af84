#include "calib/sheet_outline.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calib/probe.h"

namespace veneer::calib {
namespace {

constexpr double kOutlinePxPerMm = 6;

// Everything that is not as bright and colourless as the lid, without specks.
cv::Mat sheet_mask(const cv::Mat& darkest) {
  cv::Mat mask = darkest < 0.8 * top_level(darkest, 0.005);
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  return mask;
}

// How far beyond `p` along `outwards` the brightness steps from sheet to lid, in pixels: by the area of the step, as
// for tags. Half a pixel, the mask's own guess, where the picture ends or no step is seen.
double step_beyond(const cv::Mat& darkest, const cv::Point2d& p, const cv::Point2d& outwards) {
  constexpr int kHalf = 12;
  constexpr double kStep = 0.25;
  std::array<double, 2 * kHalf + 1> profile{};
  for (std::size_t k = 0; k < profile.size(); ++k) {
    const cv::Point2d at = p + outwards * ((static_cast<double>(k) - kHalf) * kStep);
    if (at.x < 0 || at.y < 0 || at.x > darkest.cols - 1 || at.y > darkest.rows - 1) return 0.5;
    profile[k] = level_at(darkest, at.x + 0.5, at.y + 0.5);
  }
  const double low = (profile[0] + profile[1] + profile[2]) / 3;
  const double high = (profile[2 * kHalf] + profile[2 * kHalf - 1] + profile[2 * kHalf - 2]) / 3;
  if (high - low < 20) return 0.5;
  double bright = -(profile[0] - low) / 2 - (profile[2 * kHalf] - low) / 2;
  for (const double level : profile) bright += level - low;
  return std::clamp(kHalf * kStep - bright * kStep / (high - low), -1.0, 2.0);
}

// Direction and offset of the line through the points, those far from it dropped; `angle` is near to begin with.
struct Side {
  double angle = 0, offset = 0;  // offset along the normal (-sin, cos)
  std::size_t points = 0;
};

Side fit_side(const std::vector<Eigen::Vector2d>& all, double angle, double offset, double reach) {
  Side side{angle, offset, 0};
  for (int pass = 0; pass < 5; ++pass) {
    const Eigen::Vector2d along(std::cos(side.angle), std::sin(side.angle)), normal(-along.y(), along.x());
    double n = 0, s = 0, d = 0, ss = 0, sd = 0;
    for (const Eigen::Vector2d& p : all) {
      const double far = normal.dot(p) - side.offset, at = along.dot(p);
      if (std::abs(far) > reach) continue;
      n += 1, s += at, d += far, ss += at * at, sd += at * far;
    }
    side.points = static_cast<std::size_t>(n);
    const double spread = ss - s * s / std::max(n, 1.0);
    if (n < 8 || spread < 100) return side;
    const double slope = (sd - s * d / n) / spread;
    const double turned = side.angle + std::atan(slope);
    const Eigen::Vector2d middle = along * (s / n) + normal * (side.offset + d / n);
    side.angle = turned;
    side.offset = -std::sin(turned) * middle.x() + std::cos(turned) * middle.y();
    reach = std::max(0.3, reach * 0.6);
  }
  return side;
}

}  // namespace

std::vector<Point<ScanFrame>> find_outline(const cv::Mat& picture, ScanResolution nominal) {
  if (picture.empty()) return {};
  const double shrink = std::min(1.0, kOutlinePxPerMm / nominal.px_per_mm);
  cv::Mat small;
  cv::resize(picture, small, {}, shrink, shrink, cv::INTER_AREA);
  const double scale_x = static_cast<double>(picture.cols) / small.cols,
               scale_y = static_cast<double>(picture.rows) / small.rows;
  std::vector<std::vector<cv::Point>> contours;
  const cv::Mat darkest = darkest_channel(small);
  cv::findContours(sheet_mask(darkest), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) return {};
  const auto& sheet = *std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) {
    return cv::contourArea(a) < cv::contourArea(b);
  });
  // The contour runs through the outermost pixels' centres; the border lies a little further out.
  const double side = cv::contourArea(sheet, true) > 0 ? 1 : -1;
  const std::size_t n = sheet.size(), reach = std::min<std::size_t>(6, n / 4);
  std::vector<Point<ScanFrame>> outline;
  for (std::size_t i = 0; i < n; i += static_cast<std::size_t>(kOutlinePxPerMm)) {
    const cv::Point2d p = sheet[i], run = cv::Point2d(sheet[(i + reach) % n]) - cv::Point2d(sheet[(i + n - reach) % n]);
    const double length = std::max(1e-9, std::hypot(run.x, run.y));
    const cv::Point2d outwards = side * cv::Point2d(run.y, -run.x) / length;
    const cv::Point2d out = p + cv::Point2d(0.5, 0.5) + outwards * step_beyond(darkest, p, outwards);
    outline.push_back(point<ScanFrame>(out.x * scale_x, out.y * scale_y));
  }
  return outline;
}

SheetRectangle fit_rectangle(const std::vector<Point<JoinedFrame>>& border, double up_x, double up_y) {
  std::vector<cv::Point2f> points;
  std::vector<Eigen::Vector2d> all;
  for (const auto& p : border) {
    all.emplace_back(p.x.count(), p.y.count());
    points.emplace_back(static_cast<float>(p.x.count()), static_cast<float>(p.y.count()));
  }
  const cv::RotatedRect rough = cv::minAreaRect(points);
  // Of the rectangle's four directions the one whose left side is most nearly up.
  double angle = rough.angle * kPi / 180;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double turned = rough.angle * kPi / 180 + quarter * kPi / 2;
    if (-std::sin(turned) * up_x + std::cos(turned) * up_y > -std::sin(angle) * up_x + std::cos(angle) * up_y)
      angle = turned;
  }
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), normal(-along.y(), along.x());
  double low = 1e9;
  for (const auto& p : all) low = std::min(low, normal.dot(p));
  const Side lower = fit_side(all, angle, low, 1.5);

  const Eigen::Vector2d x(std::cos(lower.angle), std::sin(lower.angle)), y(-x.y(), x.x());
  double left = 1e9, right = -1e9, top = -1e9;
  for (const auto& p : all)
    left = std::min(left, x.dot(p)), right = std::max(right, x.dot(p)), top = std::max(top, y.dot(p));
  // The upright sides as lines, seen from their middle; a side with few points keeps the outermost one.
  const auto place = [&](double at, double direction, const Eigen::Vector2d& outwards) {
    const Side side = fit_side(all, direction, at, 1.5);
    if (side.points < 8) return at;
    const Eigen::Vector2d on(-std::sin(side.angle) * side.offset, std::cos(side.angle) * side.offset);
    const Eigen::Vector2d run(std::cos(side.angle), std::sin(side.angle));
    const Eigen::Vector2d centre(rough.center.x, rough.center.y);
    return outwards.dot(on + run * run.dot(centre - on));
  };
  // The normal of direction a is (-sin a, cos a): the left side's runs down (normal +x), the top's along +x.
  left = place(left, lower.angle - kPi / 2, x);
  right = place(right, lower.angle - kPi / 2, x);
  top = place(top, lower.angle, y);

  SheetRectangle out;
  out.panel_from_joined = {Radians(-lower.angle), point<PanelFrame>(-left, -lower.offset)};
  out.width = Millimetres(right - left), out.height = Millimetres(top - lower.offset);
  return out;
}

}  // namespace veneer::calib
